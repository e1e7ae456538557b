#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/dds/announcements.hpp"
#include "api/dds/entity.hpp"
#include "api/dds/topics.hpp"
#include "api/gateway/gateway_thread.hpp"
#include "api/server/access/identity_watch.hpp"
#include "api/server/access/request_audit.hpp"
#include "api/server/access/request_check.hpp"
#include "api/server/answer_memory.hpp"
#include "api/server/clients/access_guard.hpp"
#include "api/server/clients/session_table.hpp"
#include "api/server/control_server.hpp"
#include "api/server/downloads/download_table.hpp"
#include "api/server/heap_trim.hpp"
#include "api/server/lists/node_lister.hpp"
#include "api/server/lists/object_lister.hpp"
#include "api/server/lists/variable_lister.hpp"
#include "api/server/manager_link.hpp"
#include "api/server/name_claim.hpp"
#include "api/server/posts/event_intake.hpp"
#include "api/server/status/run_watch.hpp"
#include "api/server/status/status_publisher.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// The inside of ControlServer. control_server_setup.cpp makes the parts, control_server.cpp runs them.
struct ControlServer::Parts {
  struct RequestReader {
    ApiRole role = ApiRole::operating;
    dds::TopicReader from = {};
  };

  Parts(ServerOptions given, ObjectPool attached, std::uint64_t started)
      : options(std::move(given)),
        pool(std::move(attached)),
        lister(pool),
        nodes(options.pool, options.blocks_base),
        epoch(started),
        downloads(options.pool, std::uint64_t{options.application_limit_mib} << 20U,
                  options.own_user ? DownloadTable::kForGroup : DownloadTable::kForOwner),
        runs(options.host, started) {}

  Result<void> open();
  Result<void> make_loop();
  Result<void> make_guard();
  Result<void> enter_domain();
  Result<void> claim_name();
  Result<void> make_readers();
  Result<void> listen();
  Result<void> open_gateway();
  void open_audit();
  [[nodiscard]] Result<void> raise_loop() const;
  Result<void> run();
  Result<bool> dispatch(int fd);
  void on_wake();
  void on_requests(const RequestReader& source);
  void on_request(const RequestReader& source, const plc_Request& request, const dds_sample_info_t& info);
  void do_request(ApiRole role, const dds::Guid& writer, const plc_Request& request);
  Result<void> on_manager();
  [[nodiscard]] bool identity_changed();
  [[nodiscard]] Result<bool> keeps_name();
  void tell_of_refused(TimePoint now);
  void refuse(const dds::Guid& client, const plc_Request& request, const Error& error);
  void answer(const dds::Guid& client, const plc_SampleIdentity& identity, ErrorCode code,
              std::string_view text) {
    answer_recorded(client, identity, code, text, text);
  }
  /// `recorded`: the text for the audit log.
  void answer_recorded(const dds::Guid& client, const plc_SampleIdentity& identity, ErrorCode code,
                       std::string_view text, std::string_view recorded);
  [[nodiscard]] std::string_view text_for_client(const FinishedCommand& command) const;
  void send_answer(const dds::Guid& client, const plc_SampleIdentity& identity, ErrorCode code,
                   std::string_view text);
  void tell(const dds::Guid& client, const plc_SampleIdentity& identity, ErrorCode code,
            std::string_view text);
  void send(const dds::Guid& client, const Answer& answer);
  void send_late_answers(TimePoint now);
  void answer_what_was_done();
  void answer_finished(TimePoint now);
  [[nodiscard]] bool is_late(const plc_SampleIdentity& identity) const;
  void finish(std::vector<FinishedCommand> commands);
  void ask_for_findings();
  [[nodiscard]] bool collect_findings(FinishedCommand& finished);

  // Lists: control_server_lists.cpp
  void list_objects(const dds::Guid& client, const plc_Request& request);
  void list_nodes(ControlVerb verb, const dds::Guid& client, const plc_Request& request);
  void read_log(const dds::Guid& client, const plc_Request& request);
  void list_variables(const dds::Guid& client, const plc_Request& request);
  void read_debug(const dds::Guid& client, const plc_Request& request);
  void read_trace(const dds::Guid& client, const plc_Request& request);
  void tell_variables(std::vector<VariableLister::Finished> finished);
  template <class Page>
  void send_page(const dds::Guid& client, const plc_SampleIdentity& identity, Page& page);

  // Downloads: control_server_downloads.cpp
  void begin_download(const dds::Guid& client, const plc_SampleIdentity& identity, ControlRequest request);
  void on_chunks();
  void serve_downloads(TimePoint now);

  void write_left_acks();
  void record_posts();
  void look_at_runs();

  static void on_event_post(dds_entity_t reader, void* server);
  static void on_event_batch(dds_entity_t reader, void* server);
  static void on_wake_listener(dds_entity_t reader, void* server);

  ServerOptions options;
  ObjectPool pool;
  ObjectLister lister;
  NodeLister nodes;
  std::optional<VariableLister> variables;
  std::uint64_t epoch;
  UniqueFd epoll;
  UniqueFd wake;
  UniqueFd signals;
  UniqueFd status_timer;
  UniqueFd presence_timer;
  UniqueFd identity_timer;
  AccessGuard guard;
  std::optional<IdentityWatch> identity_watch;  // of a secured host
  /// A count of which the log is told how much it has grown, at most every 10 s.
  struct ToldCount {
    /// The news to publish now.
    std::uint64_t take(std::uint64_t count, TimePoint now) noexcept {
      constexpr Duration kAtMostEvery = std::chrono::seconds(10);
      if (now - at < kAtMostEvery) return 0;
      if (count != told) at = now;
      return count - std::exchange(told, count);
    }
    std::uint64_t told = 0;
    TimePoint at;
  };
  ToldCount refused_datagrams;
  ToldCount malformed_posts;
  UniqueFd run_timer;  // set while runs are waited for
  std::optional<ManagerLink> manager;
  std::optional<EventIntake> intake;
  std::shared_ptr<dds::Entity> domain;
  dds::Entity participant;
  dds::Announcements announcements;
  std::optional<NameClaim> name;
  std::optional<SessionTable> sessions;
  HeapTrim heap;
  AnswerMemory answers;
  /// Of a request that was done, until it is in the audit log.
  struct LateAnswer {
    dds::Guid client;
    plc_SampleIdentity identity;
    ErrorCode code;
    std::string text;
    AuditWriter::Ticket ticket;
    TimePoint deadline;
  };
  /// So long an answer waits for the log.
  static constexpr Duration kAuditPatience = std::chrono::milliseconds(500);
  std::deque<LateAnswer> late_answers;
  std::vector<FinishedCommand> unanswered;  // that have finished: at most as many as may be under way
  /// So long an answer waits until the manager's page can be read.
  static constexpr Duration kPagePatience = std::chrono::milliseconds(500);
  std::optional<TimePoint> unanswered_since;  // the first attempt to answer them
  std::optional<RequestAudit> audit;
  std::optional<StatusPublisher> status;
  dds::Entity subscriber;
  dds::TopicReader event_posts;
  dds::TopicReader event_batches;
  dds::TopicReader chunks;
  DownloadTable downloads;
  RunWatch runs;
  std::array<RequestReader, 3> requests;
  std::unique_ptr<GatewayThread> gateway;  // of a host that has a number
};

/// Signals an event descriptor. Any thread.
void raise_event(int fd) noexcept;

}  // namespace plchost
