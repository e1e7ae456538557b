#include "api/server/posts/run_watch.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "api/dds/text.hpp"
#include "shm/base/wrapping.hpp"

namespace plchost {

void RunWatch::decide(Wait& wait, ErrorCode code, const std::string& text) {
  wait.decided = true;
  wait.result.code = static_cast<std::int32_t>(code);
  dds::copy_text(wait.result.text, text);
}

void RunWatch::add(const AwaitedPost& post, const TaskWatch& tasks) {
  const auto is_same = [&](const Wait& wait) {
    return wait.result.sequence_number == post.sequence && dds::Guid::from(wait.result.source) == post.source;
  };
  if (std::ranges::any_of(waits_, is_same)) return;  // a post that came again: the first one counts
  const auto of_client = std::ranges::count_if(waits_, [&](const Wait& wait) {
    return dds::Guid::from(wait.result.source).participant() == post.source.participant();
  });
  const bool full =
      waits_.size() >= kMaxWaits || runs() >= kMaxRuns || static_cast<std::size_t>(of_client) >= kMaxOfClient;
  Wait& wait = waits_.emplace_back();
  post.source.copy_to(wait.result.source);
  wait.result.sequence_number = post.sequence;
  dds::copy_text(wait.result.host, host_);
  wait.result.epoch = epoch_;
  wait.received = post.received;
  if (full) {
    return decide(
        wait, ErrorCode::full,
        fmt::format("the host waits for the runs of at most {} posts at once ({} of one client, {} tasks)",
                    kMaxWaits, kMaxOfClient, kMaxRuns));
  }
  for (const AwaitedPost::Target& target : post.targets) {
    for (auto& task : tasks.bound_tasks(target.instance, target.event)) {
      wait.runs.push_back({std::move(task), target.count});
    }
  }
  wait.result.tasks = static_cast<std::uint32_t>(wait.runs.size());
  if (wait.runs.empty()) decide(wait, ErrorCode::not_found, "no task is bound to the event");
}

std::size_t RunWatch::runs() const {
  return std::accumulate(waits_.begin(), waits_.end(), std::size_t{0},
                         [](std::size_t sum, const Wait& wait) { return sum + wait.runs.size(); });
}

void RunWatch::look_at(Wait& wait, Run& run, const TaskWatch& tasks) {
  const InstancePageReader* const page = tasks.page_of(run.task);
  const auto runtime = page != nullptr ? page->runtime() : std::nullopt;
  const auto task = page != nullptr ? page->task(run.task.index) : std::nullopt;
  if (page != nullptr && (!runtime || !task)) return;  // is being written
  const auto name = [&] {
    return task ? fmt::format("{}/{}", run.task.instance, task->identity.name.view()) : run.task.instance;
  };
  if (task && task->counters.posts_done >= run.count) {
    run.done = true;
    const TaskCounters& counters = task->counters;
    const std::int64_t start = wrapping_sum(counters.release_ns, counters.latency_last_ns);
    const std::int64_t end = wrapping_sum(start, counters.exec_last_ns);
    const std::int64_t received = wait.received.time_since_epoch().count();
    // Below 0: of a post that came again, and whose task ran for it before.
    const std::int64_t end_ns = std::max<std::int64_t>(wrapping_difference(end, received), 0);
    if (end_ns < wait.result.end_ns) return;
    wait.result.start_ns = std::max<std::int64_t>(wrapping_difference(start, received), 0);
    wait.result.end_ns = end_ns;
    dds::copy_text(wait.result.last_task, name());
  } else if (!runtime || runtime->running == 0) {
    decide(wait, ErrorCode::wrong_state, fmt::format("'{}' was stopped before it ran for the post", name()));
  } else if (task->state == PageTaskState::exception) {
    decide(wait, ErrorCode::wrong_state, fmt::format("task '{}' is in exception", name()));
  }
}

std::vector<plc_EventRun> RunWatch::look(const TaskWatch& tasks, TimePoint now) {
  std::vector<plc_EventRun> decided;
  for (auto wait = waits_.begin(); wait != waits_.end();) {
    bool all = true;
    for (Run& run : wait->runs) {
      if (wait->decided) break;
      if (!run.done) look_at(*wait, run, tasks);
      all &= run.done;
    }
    if (!wait->decided && all) wait->decided = true;
    if (!wait->decided && now - wait->received >= kLimit) {
      decide(*wait, ErrorCode::timed_out,
             "the post is in the pool, but its task has not run for it within 10 s");
    }
    if (wait->decided) decided.push_back(wait->result);
    wait = wait->decided ? waits_.erase(wait) : std::next(wait);
  }
  return decided;
}

}  // namespace plchost
