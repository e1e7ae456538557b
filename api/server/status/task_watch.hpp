#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <control.h>

#include "api/server/status/statistics_writer.hpp"
#include "api/server/status/status_table.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

/// Looks at the pages of the instances and keeps the table of tasks. Control loop only.
class TaskWatch {
 public:
  /// Each task is looked at so often.
  static constexpr Duration kPeriod = std::chrono::milliseconds(200);
  /// How many tasks are looked at in one call of look().
  static constexpr std::uint32_t kTasksPerLook = 256;
  /// The statistics of each task are told so often, if it ran.
  static constexpr Duration kStatisticsPeriod = std::chrono::seconds(1);
  /// How many of them are read and written in one call of look(). Each costs up to 0.1 ms (3 digits, values
  /// all over the range; typically a tenth of that). With a call every 10 ms that is at most a tenth of the
  /// core, and 1,600 tasks a second. With more tasks each is told less often.
  static constexpr std::uint32_t kStatisticsPerLook = 16;

  TaskWatch(std::string pool, StatusTable<plc_TaskStatus>& table, StatisticsWriter statistics)
      : pool_(std::move(pool)), table_(&table), statistics_(std::move(statistics)) {}

  /// Takes the manager's report of an instance: opens its page when there is a new process, and forgets the
  /// tasks of one that is gone. Returns true if tasks came or went.
  bool follow(const InstanceStatus& instance, TimePoint now);
  bool forget(const std::string& instance);

  /// Tasks that are due.
  void look(TimePoint now);
  /// All tasks of one instance, at once.
  void look_at(const std::string& instance, TimePoint now);

  /// A task of a process that is bound to an external event.
  struct BoundTask {
    std::string instance;
    std::int32_t pid = 0;
    std::uint32_t index = 0;
  };
  /// Those that run for a post of this event: tasks of its instance, and of others that name it in full.
  /// Costs one look into an index, which is made anew after an instance has come or gone.
  [[nodiscard]] std::span<const BoundTask> bound_tasks(std::string_view instance,
                                                       std::string_view event) const;
  /// Null: its process is gone.
  [[nodiscard]] const InstancePageReader* page_of(const BoundTask& task) const;

  /// The report of the process itself, if its page is open; as it was when it could be read last.
  [[nodiscard]] std::optional<InstanceRuntime> runtime(const std::string& instance) const;
  /// The process that runs now has this task in exception.
  [[nodiscard]] bool in_exception(const std::string& instance, std::string_view task) const;

 private:
  struct Watched {
    std::int32_t pid = 0;
    std::optional<InstancePageReader> page;
    InstanceRuntime runtime;  // of the open page
    std::uint32_t next_task = 0;
    TimePoint next_look;                       // of the page when it is not open, else of the tasks
    std::vector<StatisticsWriter::Told> told;  // one for each task of the page
    std::uint32_t next_statistics = 0;
    TimePoint next_statistics_look;
  };
  bool open_page(const std::string& instance, Watched& watched);
  void index_bound_tasks() const;
  void publish(const std::string& instance, Watched& watched, std::uint32_t index);
  void publish_name(const std::string& instance, const Watched& watched, std::uint32_t index);
  bool dispose_tasks(const std::string& instance, const Watched& watched);
  void look_at_statistics(TimePoint now);

  const std::string pool_;
  StatusTable<plc_TaskStatus>* table_;
  StatisticsWriter statistics_;
  std::map<std::string, Watched> instances_;
  mutable std::map<std::string, std::vector<BoundTask>, std::less<>> bound_;  // by the event, in full
  mutable bool bound_is_stale_ = false;
  std::string last_told_;  // the instance whose statistics were told last: the next call begins behind it
};

}  // namespace plchost
