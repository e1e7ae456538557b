// Three tasks that each write four bytes of one output area, and one that writes registers; with faults on
// demand. The last four bytes of the area are no task's own.
#include <cstdint>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

#include "../../../../instances/plc_app.hpp"

namespace {

using namespace std::chrono_literals;

struct Outputs {
  std::uint32_t fast;
  std::uint32_t slow;
  std::uint32_t valve;
  std::uint32_t common;
};

plc::Area<Outputs> outputs;
plc::Area<std::uint64_t> registers;
int* volatile nowhere = nullptr;
volatile unsigned sink = 0;
bool open = false;

void setup(plc::Application& app) {
  app.cyclic("Fast", 2, 1ms, [] {
    outputs->fast = 0x11111111;
    outputs->common = 0x44444444;
    *registers = 0x5555555555555555;
  });
  app.cyclic("Slow", 10, 20ms, [] { outputs->slow = 0x22222222; });
  app.external("Valve", 12, "valve", [] {
    outputs->valve = 0x33333333;
    if (open) *nowhere = 1;
    open = true;
  });
  app.external("Loop", 13, "loop", [] {
    for (;;) sink = sink + 1;
  });
  app.external("Crash", 14, "crash", [] { std::thread([] { *nowhere = 1; }).detach(); });
  app.external("Fork", 14, "fork", [] {
    const pid_t child = ::fork();
    if (child == 0) *nowhere = 1;
    int status = 0;
    ::waitpid(child, &status, 0);
    plc::log("forked: signal %d", WTERMSIG(status));
  });
  outputs =
      app.area<Outputs>("outputs", PLC_AREA_OUTPUT, {}, {{{"Fast", 0, 4}, {"Slow", 4, 4}, {"Valve", 8, 4}}});
  registers = app.area<std::uint64_t>("registers", PLC_AREA_OUTPUT | 0x8000, {}, {{{"Fast", 0, 8}}});
}

}  // namespace

PLC_APPLICATION("Outputs", setup)
