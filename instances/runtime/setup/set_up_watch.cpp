#include "instances/runtime/setup/set_up_watch.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "schedulers/faults/processor_guard.hpp"
#include "schedulers/supervision/starvation.hpp"
#include "shm/process/work_limit.hpp"

namespace plchost {

namespace {

constexpr Duration kLook = std::chrono::milliseconds(50);
// While the process stood still, so did the set-up.
constexpr Duration kLongestGap = std::chrono::milliseconds(200);

// Bound to the cores of the thread that sets up, or to some of them: it takes them from that one.
bool runs_beside(pid_t thread, const std::vector<int>& cores) {
  const auto there = allowed_cores(thread);
  return there && std::ranges::includes(cores, *there);
}

Result<void> look_for_taker() {
  const auto taker = ProcessorGuard::take();
  if (!taker) return {};
  return failure(ErrorCode::refused,
                 fmt::format("in the set-up, {} took the processor for {} ms without a pause: it must sleep "
                             "more often, or have no real-time priority",
                             taker->who.view(),
                             std::chrono::duration_cast<std::chrono::milliseconds>(taker->lasted).count()));
}

Result<void> has_not_returned() {
  return failure(ErrorCode::refused,
                 fmt::format("the set-up has not returned for {} s",
                             std::chrono::duration_cast<std::chrono::seconds>(SetUpWatch::kLimit).count()));
}

}  // namespace

std::optional<ProcessorGuard::Taker> LongRunSearch::look(TimePoint now) {
  // A run ends with a pause of one part of so many of it. The kernel's are shorter: 50 ms of a second.
  constexpr int kPart = 10;
  std::array<pid_t, kMost> found{};
  const std::size_t count = times_.real_time_threads(found);
  std::map<pid_t, Run> before = std::exchange(runs_, {});
  // Of several that have no pause, it is the one that runs most: the others wait for it.
  struct Longest {
    pid_t thread = 0;
    Duration used = Duration::zero();
    Duration lasted{};
  } longest;
  for (const pid_t thread : std::span(found).first(count)) {
    const Duration used = times_.of_thread(thread);
    // Others that take the processor from it give it no pause.
    const Duration busy = used + times_.ready_time_of_thread(thread);
    const Run anew{.began = now, .busy_before = busy, .used_before = used};
    const auto known = before.find(thread);
    Run run = known != before.end() ? known->second : anew;
    const Duration lasted = now - run.began;
    if (busy - run.busy_before < lasted - lasted / kPart) run = anew;
    const Duration ran = used - run.used_before;
    if (now - run.began > limit_ && ran > longest.used && concerns_(thread)) {
      longest = {.thread = thread, .used = ran, .lasted = now - run.began};
    }
    runs_.emplace(thread, run);
  }
  if (longest.thread == 0) return std::nullopt;
  const ThreadText who = times_.demote(longest.thread);
  if (who.view().empty()) return std::nullopt;
  return ProcessorGuard::Taker{.who = who, .lasted = longest.lasted};
}

SetUpWatch::SetUpWatch(Duration guard, ThreadPriority priority, Fail fail) : fail_(std::move(fail)) {
  const Duration limit = Starvation::limit_for(guard);
  if (limit == Duration::zero() || !ProcessorGuard::install()) return;
  const auto watch = [this, limit, cores = allowed_cores(0).value_or(std::vector<int>{})] {
    run(limit, cores);
  };
  auto thread = Thread::start("set-up watch", priority, watch);
  if (!thread) thread = Thread::start("set-up watch", {}, watch);
  if (!thread) return;  // the manager's limit is left
  thread_ = std::move(*thread);
  ProcessorGuard::watch_set_up(limit);
}

void SetUpWatch::run(Duration limit, const std::vector<int>& cores) {
  LongRunSearch search(linux_processor_times(), limit,
                       [&](pid_t thread) { return runs_beside(thread, cores); });
  std::unique_lock lock(mutex_);
  Duration lasted{};
  TimePoint looked = MonotonicClock::now();
  const WorkLimit work(kLimit, looked, processor_share_of(::getpid()));
  TimePoint next_look = looked + kLimit;  // at the work: that reads files
  while (!stops_.wait_for(lock, kLook, [this] { return stopped_; })) {
    const TimePoint now = MonotonicClock::now();
    lasted += std::min(now - std::exchange(looked, now), kLongestGap);
    if (const auto taker = search.look(now)) ProcessorGuard::report(taker->who, taker->lasted);
    auto good = look_for_taker();
    if (good && lasted >= kLimit && now >= next_look) {
      const Duration left = work.left(now, processor_share_of(::getpid()));
      next_look = now + left;
      if (left == Duration::zero()) good = has_not_returned();
    }
    if (!good) return fail_(good.error());
  }
}

void SetUpWatch::stop() {
  if (!thread_.joinable()) return;
  ProcessorGuard::watch(Duration::zero());
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  stops_.notify_all();
  thread_.join();
}

Result<void> SetUpWatch::end() {
  stop();
  return look_for_taker();
}

}  // namespace plchost
