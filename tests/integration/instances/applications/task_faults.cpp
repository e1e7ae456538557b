// One external event for each fault that a task can have, beside a cyclic task that has none. A task whose
// name stands in PLC_FAULT_AT_START has its fault in its first cycle, without an event.
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <alloca.h>
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include "../../../../instances/plc_app.hpp"

namespace {

using namespace std::chrono_literals;

volatile int zero = 0;
int* volatile nowhere = nullptr;
volatile int sink = 0;
std::atomic<bool> variable{false};
std::atomic<bool> variable_is_faulty{false};
std::atomic<bool> variable_throws{false};
std::atomic<bool> busy{false};
std::atomic<bool> overrun{false};

void spin(std::chrono::nanoseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (std::chrono::steady_clock::now() < end) sink = sink + 1;
}

__attribute__((noinline)) void divide() {
  sink = 42 / zero;  // 1 / x would need no division
}
__attribute__((noinline)) void read_null() {
  sink = *nowhere;
}
__attribute__((noinline)) void write_null() {
  *nowhere = 1;
}
__attribute__((noinline)) void call_null() {
  void (*volatile function)() = nullptr;
  function();
  sink = 1;
}
__attribute__((noinline)) void innermost() {
  *nowhere = 2;  // unlike that of another function, which would be the same one then
}
__attribute__((noinline)) void middle() {
  innermost();
  sink = 1;  // behind the call, so that it is none that never comes back
}
__attribute__((noinline)) void outermost() {
  middle();
  sink = 2;
}
// Its name has more than 500 bytes.
template <int... Numbers>
__attribute__((noinline)) void call_long_name(std::integer_sequence<int, Numbers...> /*unused*/) {
  innermost();
  sink = 4;
}
// Writes over its own return address, by one where no code is, and has a fault then.
__attribute__((noinline)) void smash_stack() {
  auto* const frame = static_cast<volatile std::uintptr_t*>(__builtin_frame_address(0));
  for (int i = 0; i < 8; ++i) frame[i] = reinterpret_cast<std::uintptr_t>(&sink);
  *nowhere = 3;
}
__attribute__((noinline)) int recurse(int depth) {  // NOLINT(misc-no-recursion): that is the fault
  if (zero != 0) return 0;
  volatile char frame[512];
  frame[0] = static_cast<char>(depth);
  return recurse(depth + 1) + frame[0];
}
__attribute__((noinline)) void overflow_at_once() {
  constexpr std::size_t kTooMuch = std::size_t{8} << 20;
  auto* const block = static_cast<volatile char*>(alloca(kTooMuch));
  for (std::size_t i = 0; i < kTooMuch; i += 4096) block[i] = 1;
}
__attribute__((noinline)) void loop() {
  while (zero == 0) sink = sink + 1;
}
__attribute__((noinline)) void sleep_for_ever() {
  while (zero == 0) ::sleep(1);
}

// A thread of the application's own that never ends; priority 0: as it comes.
std::atomic<bool> hog_waits{false};
std::atomic<bool> hog_goes_away{false};  // to the first core, which the tasks do not have
void loop_in_a_thread(int priority, const char* name = "hog", bool blocks_signals = false) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  if (priority > 0) {
    sched_param wanted{};
    wanted.sched_priority = priority;
    pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
    pthread_attr_setschedparam(&attributes, &wanted);
  }
  sigset_t before;
  sigset_t more;
  sigemptyset(&more);
  if (blocks_signals) sigfillset(&more);
  pthread_sigmask(SIG_BLOCK, &more, &before);  // the thread inherits it
  pthread_t thread{};
  const auto body = [](void* own_name) -> void* {
    pthread_setname_np(pthread_self(), static_cast<const char*>(own_name));
    if (hog_waits) std::this_thread::sleep_for(500ms);
    if (hog_goes_away) {
      cpu_set_t first;
      CPU_ZERO(&first);
      CPU_SET(0, &first);
      sched_setaffinity(0, sizeof first, &first);
    }
    loop();
    return nullptr;
  };
  pthread_create(&thread, &attributes, body, const_cast<char*>(name));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

__attribute__((noinline)) void throw_deep(int depth) {
  if (depth == 0) throw std::runtime_error("deep");
  throw_deep(depth - 1);
  sink = depth;
}
// One that the code catches is none of the task's.
__attribute__((noinline)) void throw_after_a_catch() {
  try {
    throw_deep(7);
  } catch (const std::runtime_error&) {
    sink = 11;
  }
  throw_deep(2);
  sink = 12;
}
__attribute__((noinline)) void throw_again() {
  try {
    throw_deep(7);
  } catch (const std::runtime_error&) {
    throw;
  }
  sink = 13;
}

// Faults that only this processor has.
#if defined(__x86_64__)
__attribute__((noinline)) void write_wild() {
  volatile std::uintptr_t wild = 0xdead'beef'dead'beef;
  *reinterpret_cast<volatile int*>(wild) = 1;  // NOLINT(performance-no-int-to-ptr): that is the fault
}
void break_in_a_thread() {
  std::thread([] { __asm__("int3"); }).join();
}
// Its caller is found by the register for frames, which points to no memory.
__attribute__((noinline)) void lose_frame() {
  auto* const block = static_cast<volatile char*>(alloca(static_cast<std::size_t>(sink) + 64));
  block[0] = 1;
  __asm__ volatile("mov $64, %%rbp\n\tmovl $1, (%%rbp)" : : : "memory");
  sink = block[0];
}
#else
void write_wild() {}
void lose_frame() {}
void break_in_a_thread() {}
#endif

void at_start(plc::Application& app) {
  const char* const fault = std::getenv("PLC_FAULT_AT_START");
  if (fault != nullptr && std::strcmp(fault, "loop") == 0) app.cyclic("FirstLoop", 2, 10ms, loop);
  if (fault != nullptr && std::strcmp(fault, "divide") == 0) app.cyclic("FirstDivide", 2, 10ms, divide);
  if (fault != nullptr && std::strcmp(fault, "overload") == 0)
    app.cyclic("Overload", 2, 1us, [] { spin(50us); });
  if (fault != nullptr && std::strcmp(fault, "variable") == 0) {
    app.event("FirstVariable", 2, [] { return (divide(), true); }, [] {});
  }
}

void setup(plc::Application& app) {
  app.cyclic("Fast", 1, 2ms, [] {});
  app.cyclic("Later", 3, 10ms, [] {
    if (busy) spin(9ms);
    if (overrun) spin(3ms);
  });
  app.cyclic("Low", 8, 10ms, [] {});
  app.external("Divide", 4, "divide", divide);
  app.external("ReadNull", 4, "read_null", read_null);
  app.external("WriteNull", 4, "write_null", write_null);
  app.external("CallNull", 4, "call_null", call_null);
  app.external("Nested", 4, "nested", [] {
    outermost();
    sink = 3;
  });
  app.external("LongName", 4, "long_name", [] {
    call_long_name(std::make_integer_sequence<int, 200>());
    sink = 5;
  });
  app.external("SmashStack", 4, "smash_stack", smash_stack);
  app.external("LoseFrame", 4, "lose_frame", lose_frame);
  app.external("Recurse", 4, "recurse", [] { sink = recurse(0); });
  app.external("Alloca", 4, "alloca", overflow_at_once);
  app.external("Abort", 4, "abort", [] { std::abort(); });
  app.external("Illegal", 4, "illegal", [] { __builtin_trap(); });
  app.external("Throw", 4, "throw", [] { throw std::runtime_error("the valve is stuck"); });
  app.external("ThrowDeep", 4, "throw_deep", [] {
    throw_after_a_catch();
    sink = 14;
  });
  app.external("ThrowAgain", 4, "throw_again", [] {
    throw_again();
    sink = 15;
  });
  app.external("ThrowManyTimes", 4, "throw_many_times", [] {
    throw_deep(40);
    sink = 16;
  });
  app.external("WriteWild", 4, "write_wild", write_wild);
  app.external("Break", 4, "break", break_in_a_thread);
  app.external("BadLog", 4, "bad_log", [] { plc_log(0, reinterpret_cast<const char*>(8)); });
  app.external("Say", 4, "say", [] { plc::log("said"); });
  app.external("Loop", 4, "loop", loop);
  app.external("SoftHog", 4, "soft_hog", [] { loop_in_a_thread(0); });
  app.external("Hog", 4, "hog", [] { loop_in_a_thread(68); });
  app.external("HighHog", 4, "high_hog", [] { loop_in_a_thread(80); });
  app.external("HighestHog", 4, "highest_hog", [] { loop_in_a_thread(99); });
  app.external("LateHog", 4, "late_hog", [] {
    hog_waits = true;
    loop_in_a_thread(60);
  });
  app.external("Compute", 4, "compute", [computes = app.open_event("computes")] {
    (void)computes.post();
    spin(1500ms);
  });
  app.external("FarHog", 4, "far_hog", [] {
    hog_goes_away = true;
    loop_in_a_thread(80);
  });
  app.external("DeafHog", 4, "deaf_hog", [] { loop_in_a_thread(60, "hog", true); });
  app.external("TwoHogs", 4, "two_hogs", [] {
    loop_in_a_thread(40, "below", true);
    loop_in_a_thread(68);
  });
  app.external("Sleep", 4, "sleep", sleep_for_ever);
  app.external("Busy", 4, "busy", [] { busy = true; });
  app.external("Overrun", 4, "overrun", [] { overrun = true; });
  app.external("Starve", 4, "starve", [] { spin(300ms); });
  app.external("Variable", 4, "variable", [] { variable_is_faulty = true; });
  app.external("VariableThrows", 4, "variable_throws", [] { variable_throws = true; });
  app.event(
      "Edge", 5,
      [] {
        if (variable_is_faulty) divide();
        if (variable_throws) throw_deep(1);
        return variable.load();
      },
      [] {});
  at_start(app);
}

}  // namespace

PLC_APPLICATION("TaskFaults", setup)
