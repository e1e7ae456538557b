// An application that the supervisor must not restart for ever: it crashes 20 ms after its start.

#include <csignal>
#include <thread>

#include "instances/plc_app.hpp"

static void setup(plc::Application& app) {
  using namespace std::chrono_literals;
  static int cycles = 0;
  app.cyclic("Crash", 5, 10ms, [] {
    if (++cycles == 3) std::thread([] { std::raise(SIGSEGV); }).join();  // not in its cycle
  });
}
PLC_APPLICATION("CrashSoon", setup)
