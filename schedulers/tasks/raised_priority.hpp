#pragma once

#include <pthread.h>
#include <sched.h>

#include "shm/base/thread.hpp"

namespace plchost {

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
