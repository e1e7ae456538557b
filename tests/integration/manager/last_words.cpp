// An application that says what goes wrong, in three ways, and ends the process in the same cycle.

#include <csignal>
#include <cstdio>
#include <thread>

#include "instances/plc_app.hpp"

static void setup(plc::Application& app) {
  using namespace std::chrono_literals;
  static int cycles = 0;
  app.cyclic("Crash", 5, 10ms, [] {
    ++cycles;
    if (cycles == 1) plc::log("valve %d is stuck", 7);
    if (cycles < 200) return;  // the lines from before have been taken by then
    std::printf("last words: pressure 9 bar\n");
    std::fprintf(stderr, "\x1b[31mred\x1b[0m");       // without an end of the line
    std::thread([] { std::raise(SIGSEGV); }).join();  // not in its cycle: that would be an exception
  });
}
PLC_APPLICATION("LastWords", setup)
