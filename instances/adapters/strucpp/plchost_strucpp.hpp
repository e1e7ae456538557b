// Included before all C++ that STruC++ has written: its library, with two parts that suit a host.
#ifndef PLCHOST_STRUCPP_HPP
#define PLCHOST_STRUCPP_HPP

#include <cstdlib>
#include <ctime>
#include <exception>
#include <mutex>
#include <type_traits>

#include <pthread.h>

#include "plchost_adapter.h"

extern "C" timespec* plchost_now(void);
extern "C" void plc_log(int level, const char* text);  // of plc_app.h, whose other names the program may have

// Each access to a global takes its mutex. The library's own has no priority inheritance: a task that waits
// for a task of lower priority would wait for all tasks between them, too.
namespace std {
class plchost_mutex {
 public:
  plchost_mutex() noexcept {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
  }
  plchost_mutex(const plchost_mutex&) = delete;
  plchost_mutex& operator=(const plchost_mutex&) = delete;
  ~plchost_mutex() { pthread_mutex_destroy(&mutex_); }
  void lock() { pthread_mutex_lock(&mutex_); }
  void unlock() { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};
}  // namespace std
#define mutex plchost_mutex
#include "iec_global.hpp"
#undef mutex
#include "iec_array.hpp"
#include "iec_std_lib.hpp"

// The library's clock is a variable of each thread, which takes memory at its first use. This one is that of
// the begin of the task's cycle.
namespace strucpp {
inline IEC_TIME plchost_time() {
  const timespec* const now = plchost_now();
  return IEC_TIME(static_cast<TIME_t>(now->tv_sec * 1000000000LL + now->tv_nsec));
}
}  // namespace strucpp
#define TIME(...) plchost_time(__VA_ARGS__)

// The part of a copy that is exchanged at a time: of an array an element. Not evaluated.
template <class T>
T& plchost_piece(T& value);
template <class T, class Bounds>
T& plchost_piece(strucpp::IEC_ARRAY_1D<T, Bounds>& array);
template <class T, class First, class Second>
T& plchost_piece(strucpp::IEC_ARRAY_2D<T, First, Second>& array);
template <class T, class First, class Second, class Third>
T& plchost_piece(strucpp::IEC_ARRAY_3D<T, First, Second, Third>& array);

// An index outside of its array, or a reference to nothing: the library throws. The task gets an exception.
template <class Program>
inline void plchost_run(Program& program) noexcept {
  try {
    program.run();
  } catch (const std::exception& error) {
    plc_log(2, error.what());
    std::abort();
  } catch (...) {
    plc_log(2, "the program threw something that is no std::exception");
    std::abort();
  }
}

#endif
