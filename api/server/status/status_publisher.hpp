#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <control.h>

#include "api/control/host_finding.hpp"
#include "api/dds/topics.hpp"
#include "api/server/status/application_watch.hpp"
#include "api/server/status/exception_watch.hpp"
#include "api/server/status/host_grid.hpp"
#include "api/server/status/host_load.hpp"
#include "api/server/status/loss_publisher.hpp"
#include "api/server/status/status_table.hpp"
#include "api/server/status/status_tables.hpp"
#include "api/server/status/task_watch.hpp"
#include "api/server/status/transition_publisher.hpp"
#include "api/server/status/writer_watch.hpp"
#include "shm/pages/host_page_copy.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// Shows the pool's pages as status topics: written when something changed, disposed when it is gone. And
/// each change of state of an instance, before the status that tells how many there were. Control loop only.
class StatusPublisher {
 public:
  struct Source {
    std::string host;
    const ObjectPool* pool = nullptr;
    std::uint64_t epoch = 0;
    std::string run_directory;
    std::string labels;  ///< with commas between
    bool secured = false;
    std::string applications_folder;  ///< of those that were sent; empty: there is none
  };
  /// Waits until the manager's page can be read, up to kPageWait: no reader is told of a host without its
  /// instances.
  [[nodiscard]] static Result<StatusPublisher> create(dds_entity_t participant, const Source& source);

  /// Writes what is due; to be called every kTick.
  void tick(TimePoint now);
  /// Writes all that concerns an instance at once: before the answer to a command that changed it. False: the
  /// manager was just writing its page, so the command's effect may not be there yet.
  bool flush(const std::vector<std::string>& instances, TimePoint now);
  /// Whether the objects may be looked at again: of a large pool that takes its time, and most of the time is
  /// for others.
  [[nodiscard]] bool may_flush(TimePoint now) const noexcept { return now >= rested_; }
  void write_presence();
  /// The fate of each client's posts, if it is time to look at that. Comes before tick().
  void look_at_writers(const EventIntake& intake, const SessionTable& sessions, TimePoint now);
  /// All findings of one check of the host, in place of those of the one before.
  void publish_findings(const std::vector<HostFinding>& findings);

  /// The audit log as a reader can check it later: that nothing was cut off.
  struct AuditState {
    std::uint64_t number = 0;  ///< of the last record; 0: there is none
    std::string hash;          ///< of that record
    std::string problem;       ///< why changes are not recorded; empty: they are
    bool operator==(const AuditState&) const = default;
  };
  void set_audit(const AuditState& audit);
  /// Another host that uses the name of this one, for people; empty: none.
  void set_rival(std::string rival);

  [[nodiscard]] const TaskWatch& tasks() const noexcept { return tasks_; }
  /// HostStatus.round as last written.
  [[nodiscard]] std::uint64_t round() const noexcept { return round_; }
  /// As the manager has told it last.
  [[nodiscard]] const HostStatus& host() const noexcept { return *page_.host(); }
  /// The instances that the manager has at present.
  [[nodiscard]] const std::vector<std::string>& instances() const noexcept { return instance_names_; }

  static constexpr Duration kTick = std::chrono::milliseconds(10);
  /// Events and objects are looked at so often.
  static constexpr Duration kObjectPeriod = std::chrono::milliseconds(200);
  /// Of more events as many are published: those first that are in use, then by name.
  static constexpr std::size_t kMostEvents = 4096;
  static constexpr Duration kPageWait = std::chrono::seconds(1);

 private:
  StatusPublisher(Source source, std::unique_ptr<StatusTables> tables, TaskWatch tasks,
                  ExceptionWatch exceptions, TransitionPublisher transitions)
      : source_(std::move(source)),
        tables_(std::move(tables)),
        tasks_(std::move(tasks)),
        exceptions_(std::move(exceptions)),
        transitions_(std::move(transitions)),
        page_(source_.pool->name()) {}
  bool look_at_instances(TimePoint now);
  bool update_instance(const InstanceStatus& status, TimePoint now, std::string& unsaved);
  bool look_at_objects(TimePoint now);
  bool update_event(const ObjectInfo& event);
  void write_host(bool changed);

  Source source_;
  AuditState audit_;
  std::string rival_;
  HostLoad load_;
  HostGrid grid_;
  std::uint32_t running_ = 0;  ///< instances
  std::uint32_t objects_ = 0;  ///< of the pool
  std::string unsaved_;        ///< instances whose newest retain values are in no file, with commas between
  std::unique_ptr<StatusTables> tables_;  ///< the watches below write into them
  TaskWatch tasks_;
  ExceptionWatch exceptions_;
  TransitionPublisher transitions_;
  HostPageCopy page_;
  std::vector<std::string> instance_names_;
  StatusTable<plc_HostFinding> findings_;
  StatusTable<plc_HostStatus> hosts_;
  ApplicationWatch applications_;
  WriterWatch writers_;
  LossPublisher losses_;
  bool writers_changed_ = false;
  dds::TopicWriter presence_;
  dds::Entity publisher_;
  TimePoint next_objects_;
  TimePoint rested_;
  std::uint64_t round_ = 0;
};

}  // namespace plchost
