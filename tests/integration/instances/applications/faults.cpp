// An application with one fault, chosen when it is compiled. Everything else about it is right.
#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include <unistd.h>

#include "../../../../instances/plc_app.h"

namespace {

void cycle() {}

#ifdef FAULT_BAD_INTERVAL
constexpr unsigned kInterval = 0;
#else
constexpr unsigned kInterval = 10;
#endif

Task_Info task{.stName = "Only",
               .nPriority = 1,
               .KindOfTask = Cyclic,
               .bMicroseconds = 0,
               .dwInterval = kInterval,
               .dwEventFunctionPointer = nullptr,
               .stExternalEvent = "",
               .dwTaskEntryFunctionPointer = cycle,
               .tLastCycleTime = 0,
               .tAverageCycleTime = 0,
               .tMaxCycleTime = 0,
               .tMinCycleTime = 0,
               .tJitterMax = 0,
               .tJitterLast = 0};
[[maybe_unused]] sys_setup_tasks_struct configuration{
    .nTasks = 1, .stApplicationName = "Faulty", .ptaskinfo = &task};

}  // namespace

#ifdef FAULT_WRONG_VERSION
const unsigned int plc_app_abi = PLC_APP_ABI_VERSION + 41;
#else
PLC_EXPORT_ABI;
#endif

#ifdef FAULT_UNDEFINED_SYMBOL
extern "C" void function_of_another_runtime();
#endif

#ifdef FAULT_UNDEFINED_METHOD
namespace other {
void method_of_another_library(int number);
}
#endif

#ifdef FAULT_CRASHES
[[gnu::noinline]] void open_valve(volatile int* valve) {
  *valve = 1;
}
#endif

#ifdef FAULT_OVERFLOWS
[[gnu::noinline]] int deeper(int level) {
  volatile char room[4096];  // NOLINT(modernize-avoid-c-arrays): the stack is what it fills
  room[0] = static_cast<char>(level);
  return level == 0 ? 0 : deeper(level + 1) + room[0];
}
#endif

#ifdef FAULT_EXIT_THROWS
void plc_app_exit() {
  throw std::runtime_error("the valve does not close");
}
#endif

#ifdef FAULT_EXIT_ABORTS
void plc_app_exit() {
  std::abort();
}
#endif

#ifndef FAULT_MISSING_INIT
int plc_app_init() {
#ifdef FAULT_UNDEFINED_SYMBOL
  function_of_another_runtime();
#endif
#ifdef FAULT_UNDEFINED_METHOD
  other::method_of_another_library(1);
#endif
#ifdef FAULT_EXITS
  std::_Exit(0);
#endif
#ifdef FAULT_EXITS_REFUSED
  std::_Exit(3);
#endif
#ifdef FAULT_LOOPS
  for (volatile bool again = true; again;) ::usleep(1000);
#endif
#ifdef FAULT_CRASHES
  open_valve(nullptr);
#endif
#ifdef FAULT_OVERFLOWS
  return deeper(1);
#endif
#ifdef FAULT_KILLS_GROUP
  ::kill(0, SIGKILL);
#endif
#ifdef FAULT_CLOSES
  constexpr int kAll = 256;
  for (int fd = 3; fd < kAll; ++fd) ::close(fd);
#endif
#ifdef FAULT_FORKS
  if (::fork() == 0) {
    for (;;) ::pause();
  }
#endif
#ifdef FAULT_LEAVES
  // As a daemon does: in no session and no process group of the instance.
  if (::fork() == 0) {
    ::setsid();
    if (::fork() != 0) ::_exit(0);
    for (;;) ::pause();
  }
#endif
#ifdef FAULT_THROWS
  throw std::runtime_error("no valve is connected");
#endif
#ifndef FAULT_NO_TASKS
  __sys__setup__tasks(&configuration);
#endif
#ifdef FAULT_TWO_SETUPS
  __sys__setup__tasks(&configuration);
#endif
#ifdef FAULT_INIT_FAILS
  return 7;
#else
  return 0;
#endif
}
#else
void keeps_the_compiler_from_calling_it_unused() {
  __sys__setup__tasks(&configuration);
}
#endif
