#include "api/server/status/run_watch.hpp"

#include <algorithm>
#include <iterator>
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
  if (!known_.emplace(post.source, post.sequence).second) return;  // came again: the first one counts
  std::size_t& of_client = of_client_[post.source.participant()];
  const bool full =
      waits_.size() >= kMaxWaits || runs_ + post.targets.size() > kMaxRuns || of_client >= kMaxOfClient;
  ++of_client;
  Wait& wait = waits_.emplace_front();
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
  if (post.unrun) return decide(wait, post.unrun->code, post.unrun->message);
  std::ranges::copy_if(post.targets, std::back_inserter(wait.unknown), &Target::taken);
  runs_ += wait.unknown.size();
  find_tasks(wait, tasks);
  if (wait.runs.empty() && wait.unknown.empty()) {
    decide(wait, ErrorCode::not_found, "no task was bound to the event, so none runs for the post");
  }
}

// Tasks take posts from before until after their instance's page is looked at: one that is not there yet is
// looked for again.
void RunWatch::find_tasks(Wait& wait, const TaskWatch& tasks) {
  std::erase_if(wait.unknown, [&](const Target& target) {
    const auto found = tasks.bound_tasks(target.instance, target.event);
    for (const auto& task : found) wait.runs.push_back({task, target});
    if (found.empty()) return false;
    runs_ += found.size() - 1;
    return true;
  });
  wait.result.tasks = static_cast<std::uint32_t>(wait.runs.size());
}

void RunWatch::forget(const Wait& wait) {
  const dds::Guid source = dds::Guid::from(wait.result.source);
  known_.erase({source, wait.result.sequence_number});
  runs_ -= wait.runs.size() + wait.unknown.size();
  const auto client = of_client_.find(source.participant());
  if (--client->second == 0) of_client_.erase(client);
}

void RunWatch::look_at(Wait& wait, Run& run, const TaskWatch& tasks) {
  // First, so that the task's counters are final if it says no.
  const bool taken = run.target.handle.valid() && run.target.handle.counted().snapshot().taken();
  const InstancePageReader* const page = tasks.page_of(run.task);
  const auto runtime = page != nullptr ? page->runtime() : std::nullopt;
  const auto task = page != nullptr ? page->task(run.task.index) : std::nullopt;
  if (page != nullptr && (!runtime || !task)) return;  // is being written
  // Running, in its last cycles, or about to run: a stop is told when the last cycle has ended.
  const bool stopping = runtime && (runtime->state == ApplicationState::stopping ||
                                    runtime->state == ApplicationState::single_cycle);
  const bool runs = runtime && (runtime->running != 0 || stopping || taken);
  const auto name = [&] {
    return task ? fmt::format("{}/{}", run.task.instance, task->identity.name.view()) : run.task.instance;
  };
  if (task && task->counters.posts_done >= run.target.count) {
    run.done = true;
    const TaskCounters& counters = task->counters;
    if (run.target.count <= counters.posts_lost_last) {
      // Of losses before the last one nothing is known.
      const bool lost = run.target.exact && run.target.count >= counters.posts_lost_first;
      return decide(wait, ErrorCode::wrong_state,
                    fmt::format("{}: '{}' lost posts, as it was stopped or had too many of them",
                                lost ? "the post was lost" : "whether it was run is not known", name()));
    }
    const std::int64_t start = wrapping_sum(counters.release_ns, counters.latency_last_ns);
    const std::int64_t end = wrapping_sum(start, counters.exec_last_ns);
    const std::int64_t received = wait.received.time_since_epoch().count();
    // Below 0: of a post that came again, and whose task ran for it before.
    const std::int64_t end_ns = std::max<std::int64_t>(wrapping_difference(end, received), 0);
    if (end_ns < wait.result.end_ns) return;
    wait.result.start_ns = std::max<std::int64_t>(wrapping_difference(start, received), 0);
    wait.result.end_ns = end_ns;
    dds::copy_text(wait.result.last_task, name());
  } else if (!runs) {
    decide(wait, ErrorCode::wrong_state,
           run.target.exact
               ? fmt::format("'{}' was stopped before it ran for the post", name())
               : fmt::format("'{}' was stopped; whether it ran for the post before is not known", name()));
  } else if (task->state == PageTaskState::exception) {
    decide(wait, ErrorCode::wrong_state, fmt::format("task '{}' is in exception", name()));
  }
}

// Returns how many tasks that were.
std::size_t RunWatch::look_at(Wait& wait, const TaskWatch& tasks) {
  if (wait.decided) return 1;
  if (!wait.unknown.empty()) find_tasks(wait, tasks);
  bool all = wait.unknown.empty();
  for (Run& run : wait.runs) {
    if (!run.done) look_at(wait, run, tasks);
    if (wait.decided) return wait.runs.size();
    all &= run.done;
  }
  wait.decided = all;
  return wait.runs.size() + wait.unknown.size();
}

std::vector<plc_EventRun> RunWatch::look(const TaskWatch& tasks, TimePoint now) {
  std::vector<plc_EventRun> decided;
  std::size_t looked = 0;
  for (std::size_t left = waits_.size(); left > 0 && looked < kAtOnce; --left) {
    const auto wait = waits_.begin();
    looked += look_at(*wait, tasks);
    if (!wait->decided && now - wait->received >= kLimit) {
      decide(*wait, ErrorCode::timed_out,
             "the post is in the pool, but its task has not run for it within 10 s");
    }
    if (wait->decided) {
      decided.push_back(wait->result);
      forget(*wait);
      waits_.erase(wait);
    } else {
      waits_.splice(waits_.end(), waits_, wait);
    }
  }
  return decided;
}

}  // namespace plchost
