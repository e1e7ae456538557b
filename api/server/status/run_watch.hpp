#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <control.h>

#include "api/server/posts/event_intake.hpp"
#include "api/server/status/task_watch.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Waits for the tasks that run for a post to come to the ends of their cycles. It looks at the instances'
/// pages, so that neither the task nor the poster has anything to do for it. Control loop only.
class RunWatch {
 public:
  static constexpr std::size_t kMaxOfClient = 64;
  static constexpr std::size_t kMaxWaits = 1024;
  /// A batch waits for the tasks of all of its events.
  static constexpr std::size_t kMaxRuns = 4096;
  /// A task that has not run by then is not waited for.
  static constexpr Duration kLimit = std::chrono::seconds(10);
  /// While something is waited for it is looked so often.
  static constexpr Duration kPeriod = std::chrono::microseconds(200);
  /// So many tasks are looked at in one call of look(), in turns.
  static constexpr std::size_t kAtOnce = 256;

  RunWatch(std::string host, std::uint64_t epoch) : host_(std::move(host)), epoch_(epoch) {}

  void add(const AwaitedPost& post, const TaskWatch& tasks);
  /// The present decisions.
  [[nodiscard]] std::vector<plc_EventRun> look(const TaskWatch& tasks, TimePoint now);
  [[nodiscard]] bool empty() const noexcept { return waits_.empty(); }

 private:
  using Target = AwaitedPost::Target;
  struct Run {
    TaskWatch::BoundTask task;
    Target target;
    bool done = false;
  };
  struct Wait {
    plc_EventRun result{};
    TimePoint received;
    std::vector<Run> runs;
    std::vector<Target> unknown;  // without a sight of its tasks yet
    bool decided = false;
  };
  void find_tasks(Wait& wait, const TaskWatch& tasks);
  [[nodiscard]] std::size_t look_at(Wait& wait, const TaskWatch& tasks);
  void forget(const Wait& wait);
  static void decide(Wait& wait, ErrorCode code, const std::string& text);
  static void look_at(Wait& wait, Run& run, const TaskWatch& tasks);

  std::string host_;
  std::uint64_t epoch_;
  std::list<Wait> waits_;                                // the one that was looked at last is last
  std::set<std::pair<dds::Guid, std::uint64_t>> known_;  // source and number of each
  std::unordered_map<dds::Guid, std::size_t, dds::GuidHash> of_client_;
  std::size_t runs_ = 0;  // of all, with targets that are not known yet
};

}  // namespace plchost
