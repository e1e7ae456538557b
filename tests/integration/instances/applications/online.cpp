// A program in versions of which some can take over from the first one while it runs, and others cannot: see
// CMakeLists.txt for what each is made with.
#include <array>
#include <atomic>
#include <cstdlib>
#include <ctime>

#include "../../../../instances/plc_app.hpp"

#ifndef VERSION
#define VERSION 1
#endif
#ifndef NAME
#define NAME "Online"
#endif
#ifndef INTERVAL
#define INTERVAL 2ms
#endif
#ifndef PRIORITY
#define PRIORITY 5
#endif
#ifndef LAYOUT
#define LAYOUT 1
#endif
#ifndef AREA_LAYOUT
#define AREA_LAYOUT 1
#endif
#ifndef AREA_FLAGS
#define AREA_FLAGS PLC_AREA_MEMORY
#endif
#ifndef WATCHDOG
#define WATCHDOG 0us
#endif
#ifndef EVENT
#define EVENT "work"
#endif
#ifndef INIT
#define INIT
#endif

namespace {

using namespace std::chrono_literals;

struct Machine {
  unsigned long counter;  // 1 by cycle; from version 2 on 1000
  unsigned long works;
#ifdef LARGER
  unsigned long more;
#endif
};

Machine machine{};
unsigned long fresh = 0;  // of which nothing is said: begins anew
std::atomic<bool> hold{false};
plc::Area<unsigned long> area;
plc::Area<unsigned long> kept;
void* area_in_init = nullptr;

void cycle() {
  constexpr unsigned long kStep = VERSION >= 2 ? 1000 : 1;
  machine.counter += kStep;
  *area += kStep;
  *kept += kStep;
  ++fresh;
  if (hold) {
    hold = false;
    const timespec pause{.tv_sec = 3, .tv_nsec = 0};
    ::nanosleep(&pause, nullptr);
  }
}

// The figure of the task in the last report's cycle is in the program's own memory.
void report() {
  unsigned long counter = 0;
  std::array<unsigned long, 3> others{};
  do {  // until no cycle of the other task, which interrupts this one, came between the looks
    counter = const_cast<volatile unsigned long&>(machine.counter);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    others = {*area, *kept, fresh};
    std::atomic_signal_fence(std::memory_order_seq_cst);
  } while (counter != const_cast<volatile unsigned long&>(machine.counter));
  plc::log("version %d counter %lu area %lu kept %lu fresh %lu works %lu own figures %d init saw area %d",
           VERSION, counter, others[0], others[1], others[2], machine.works,
           plc_current_task()->tMaxCycleTime > 0 ? 1 : 0, area_in_init != nullptr ? 1 : 0);
}

#ifdef UNIQUE
}  // namespace
// Exists once in a process.
template <class T>
struct Shared {
  static inline T value{};
};
namespace {
unsigned long use_shared() {
  return ++Shared<unsigned long>::value;
}
#endif

// Its signal, not a sanitizer's report, is what the runtime is to see.
__attribute__((noinline, no_sanitize_address, no_sanitize("undefined"))) void fault_of_version() {
  volatile int* const nowhere = nullptr;
  *nowhere = VERSION;
}

#ifdef LATE_EVENT
void CDECL register_late(unsigned int, const EVTPARAM_ExternalEventTask*, void*) {
  (void)SchedRegisterExternalEvent("late", nullptr);
}
#endif

void setup(plc::Application& app) {
  INIT;
#ifdef OPTIONS_OF_NOBODY
  Task_Options nobody{};
  nobody.dwSize = sizeof nobody;
  (void)plc_set_task_options("Nobody", &nobody);
#endif
#ifdef LATE_EVENT
  EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, register_late, nullptr);
#endif
#ifdef SLOW_INIT
  const timespec pause{.tv_sec = SLOW_INIT, .tv_nsec = 0};
  ::nanosleep(&pause, nullptr);
#endif
#ifdef INIT_CRASHES
  std::abort();
#endif
#ifdef UNIQUE
  fresh = use_shared();
#endif
#ifdef REORDERED
  app.external("Report", 6, "report", report);
#endif
#ifndef WITHOUT_LOOP
  app.freewheeling("Loop", 20, [] {});
#endif
  app.cyclic("Main", PRIORITY, INTERVAL, cycle);
#ifndef REORDERED
  app.external("Report", 6, "report", report);
#endif
  app.external("Work", 7, EVENT, [] { ++machine.works; });
  app.external("Hold", 8, "hold", [] { hold = true; });
  app.external("Fault", 9, "fault", fault_of_version);
  app.event("Edge", 10, [] { return false; }, [] {});
#ifdef ANOTHER_TASK
  app.cyclic("Another", 12, 10ms, [] {});
#endif
  plc::TaskOptions options;
  options.watchdog_time = WATCHDOG;
  app.options("Main", options);
  area = app.area<unsigned long>("plain", AREA_FLAGS, 7);
  plc::AreaOptions layout;
  layout.layout = AREA_LAYOUT;
  kept = app.area<unsigned long>("kept", PLC_AREA_RETAIN, 0, layout);
#ifdef ANOTHER_AREA
  app.area<int>("another", PLC_AREA_MEMORY);
#endif
  area_in_init = area.get();
  app.keep("machine", machine, LAYOUT);
#if VERSION >= 2
  static long added = 5;
  app.keep("added", added);
#endif
  plc::log("init of version %d, online %d", VERSION, plc::online_change() ? 1 : 0);
  app.on_exit([] { plc::log("exit of version %d, online %d", VERSION, plc::online_change() ? 1 : 0); });
}

}  // namespace

PLC_APPLICATION(NAME, setup)
