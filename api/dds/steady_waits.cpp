// Cyclone 0.10 waits until a time of the clock on the wall. If somebody sets that back by an hour, a thread
// that waits just then sleeps an hour longer. A host is not found any more, repeats nothing, and its clients
// overlook their limits. So the time that is left is waited by a clock that nobody can set.
#include "api/dds/steady_waits.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>

#include <dds/ddsrt/sync.h>
#include <dds/ddsrt/time.h>
#include <pthread.h>
#include <time.h>

#include "shm/base/time.hpp"

namespace plchost::dds {

void wait_by_steady_clock() noexcept {}

namespace {

// As Cyclone's own. False: the time is over.
bool wait_for(ddsrt_cond_t& condition, ddsrt_mutex_t& mutex, dds_duration_t left) noexcept {
  constexpr Duration kLongest = std::chrono::hours(24 * 365);  // no sum overflows
  const Duration bounded = std::clamp(Duration(left), Duration::zero(), kLongest);
  const timespec until = to_timespec(MonotonicClock::now() + bounded);
  switch (::pthread_cond_clockwait(&condition.cond, &mutex.mutex, CLOCK_MONOTONIC, &until)) {
    case 0:
      return true;
    case ETIMEDOUT:
      return false;
    default:
      std::abort();
  }
}

}  // namespace

}  // namespace plchost::dds

// A program's own functions go before those of a library that calls them by name, as Cyclone does.
extern "C" __attribute__((visibility("default"))) bool ddsrt_cond_waitfor(ddsrt_cond_t* condition,
                                                                          ddsrt_mutex_t* mutex,
                                                                          dds_duration_t left) {
  if (left != DDS_INFINITY) return plchost::dds::wait_for(*condition, *mutex, left);
  ddsrt_cond_wait(condition, mutex);
  return true;
}

extern "C" __attribute__((visibility("default"))) bool ddsrt_cond_waituntil(ddsrt_cond_t* condition,
                                                                            ddsrt_mutex_t* mutex,
                                                                            dds_time_t time) {
  return ddsrt_cond_waitfor(condition, mutex, time == DDS_NEVER ? DDS_INFINITY : time - dds_time());
}
