#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include <sys/types.h>

#include "schedulers/faults/processor_guard.hpp"
#include "schedulers/faults/processor_times.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// Finds threads of this process with a real-time priority that run without a pause, by the processor time
/// that each has used from look to look. The limit of the kernel (see ProcessorGuard) cannot interrupt one
/// that blocks SIGXCPU, and counts nothing on a core without ticks. The 50 ms that the kernel takes in each
/// second from all real-time threads of a core are no pause. One thread at a time; set-up.
class LongRunSearch {
 public:
  /// More threads with a real-time priority than that are not looked at.
  static constexpr std::size_t kMost = 256;

  /// `limit`: a thread may run for so long. `concerns`: threads for which it says false may run for ever.
  LongRunSearch(const ProcessorTimes& times, Duration limit, std::function<bool(pid_t)> concerns)
      : times_(times), limit_(limit), concerns_(std::move(concerns)) {}

  /// Takes the real-time priority from a thread that has run for longer than the limit. To be called several
  /// times within that.
  [[nodiscard]] std::optional<ProcessorGuard::Taker> look(TimePoint now);

 private:
  /// The longest run up to the last look in which the thread has done next to nothing else.
  struct Run {
    TimePoint began;
    Duration busy_before{};  // of the thread, when that began
    Duration used_before{};  // the part of it in which it had the processor
  };

  const ProcessorTimes& times_;
  Duration limit_;
  std::function<bool(pid_t)> concerns_;
  std::map<pid_t, Run> runs_;
};

/// Watches over code of components and of the application in the set-up, which runs on the control thread
/// outside of any cycle. A thread of theirs that takes the processor by a real-time priority loses that, and
/// the set-up fails. So it does when it does not return. A thread that blocks SIGXCPU is found, too, unless
/// it runs at SCHED_FIFO 99 and the kernel leaves no time to others (sched_rt_runtime_us is -1).
class SetUpWatch {
 public:
  /// A set-up may take so long: less than the manager gives the whole start, so that its cause is told. Time
  /// in which other programs have the processor does not count, here and there (WorkLimit).
  static constexpr Duration kLimit = std::chrono::seconds(25);
  /// Ends the process, because the thread that sets up may never return. Called by a thread of this class.
  using Fail = std::function<void(const Error& error)>;

  /// Above all threads of the application. For an instance on its own core.
  static constexpr ThreadPriority kAboveAll{.fifo = 99};

  /// The calling thread sets up from now on. `guard`: the time of the guard against endless loops; 0: nothing
  /// is watched, for work with a debugger. `priority`: of the watching thread, if the host allows it. Without
  /// a real-time one (a trial, which may share its core with an instance) a thread that blocks SIGXCPU is
  /// found only in time that the kernel leaves to others.
  SetUpWatch(Duration guard, ThreadPriority priority, Fail fail);
  SetUpWatch(const SetUpWatch&) = delete;
  SetUpWatch& operator=(const SetUpWatch&) = delete;
  ~SetUpWatch() { stop(); }

  /// The set-up has returned. The error that was found, if it has not ended the process.
  [[nodiscard]] Result<void> end();

 private:
  void run(Duration limit, const std::vector<int>& cores);
  void stop();

  Fail fail_;
  std::mutex mutex_;
  std::condition_variable stops_;
  bool stopped_ = false;
  Thread thread_;
};

}  // namespace plchost
