#pragma once

#include <cstdint>

#include <pthread.h>
#include <sched.h>

#include "shm/threads/thread.hpp"

namespace plchost {

/// Which part of SCHED_FIFO's range an instance uses, so that of two instances on one core one goes first.
///            supervision  tick   IEC 0..15   switch
///   high         89        88     87..72       71
///   normal       69        68     67..52       51
///   low          49        48     47..32       31
/// All of them are above the API server's threads (at most 20).
enum class PriorityBand : std::uint8_t { high, normal, low };

[[nodiscard]] ThreadPriority supervision_priority(PriorityBand band) noexcept;
[[nodiscard]] ThreadPriority tick_priority(PriorityBand band) noexcept;
/// `iec_priority` 0 to 31. 16..31 become SCHED_OTHER with nice 0..15.
[[nodiscard]] ThreadPriority task_priority(PriorityBand band, int iec_priority) noexcept;
/// Of the control thread while it exchanges the scheduler: it delays no task, and nobody else delays it.
[[nodiscard]] ThreadPriority switch_priority(PriorityBand band) noexcept;

/// As long as it exists, the calling thread runs at `priority`; without SCHED_FIFO, or the right to it, as
/// before.
class RaisedPriority {
 public:
  explicit RaisedPriority(ThreadPriority priority) noexcept {
    if (priority.fifo == 0) return;
    if (pthread_getschedparam(pthread_self(), &policy_, &before_) != 0) return;
    const sched_param raised{.sched_priority = priority.fifo};
    raised_ = pthread_setschedparam(pthread_self(), SCHED_FIFO, &raised) == 0;
  }
  RaisedPriority(const RaisedPriority&) = delete;
  RaisedPriority& operator=(const RaisedPriority&) = delete;
  ~RaisedPriority() {
    if (raised_) pthread_setschedparam(pthread_self(), policy_, &before_);
  }

 private:
  int policy_ = SCHED_OTHER;
  sched_param before_{};
  bool raised_ = false;
};

}  // namespace plchost
