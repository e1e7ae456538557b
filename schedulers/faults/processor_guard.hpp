#pragma once

#include <optional>

#include "schedulers/faults/processor_times.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Finds a thread of this process whose real-time priority is above the supervision's, and which takes the
/// processor from that, too. Nothing of the runtime runs then on this core, so the kernel looks. It counts
/// for how long a real-time thread runs without a pause (RLIMIT_RTTIME) and interrupts it there (SIGXCPU). If
/// the runtime has given no sign meanwhile, the thread gives its real-time priority up.
///
/// The kernel counts in its ticks: on a core without them (nohz_full) it finds nothing, and it cannot
/// interrupt a thread that blocks SIGXCPU. TaskSet::look_after_processor() finds those if the kernel leaves
/// time to threads without real-time priority, and the manager finds that the instance does not answer.
///
/// There is one for the process, as there is one such limit.
class ProcessorGuard {
 public:
  struct Taker {
    ThreadText who;     ///< "thread 'hog' (SCHED_FIFO 80)": its name and scheduling
    Duration lasted{};  ///< since the last sign of the runtime
  };

  /// Once, before there are other threads; until then watch() does nothing. Set-up.
  [[nodiscard]] static Result<void> install();
  /// `limit`: for how long a thread may run without a pause while nothing of the runtime does; 0: for ever.
  /// That is the beginning of it. Any thread.
  static void watch(Duration limit) noexcept;
  /// The calling thread sets the application up, until watch() is called. Neither this thread nor one that
  /// may run wherever it may keeps a real-time priority for longer than `limit` without a pause, whether the
  /// runtime gives signs or not.
  static void watch_set_up(Duration limit) noexcept;
  /// The calling thread gets the processor: the one of the runtime that must. Called several times within the
  /// limit. Real-time, three system calls.
  static void alive() noexcept;
  /// A thread was found and has no real-time priority any more. Any context.
  static void report(const ThreadText& who, Duration lasted) noexcept;
  /// The one that was reported, once. Any thread, real-time.
  [[nodiscard]] static std::optional<Taker> take() noexcept;
};

}  // namespace plchost
