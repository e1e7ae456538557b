// An application that says much: 2 MB a second on standard output, from its cycles.

#include <cstdio>

#include "instances/plc_app.hpp"

static void setup(plc::Application& app) {
  using namespace std::chrono_literals;
  static int cycles = 0;
  app.cyclic("Chat", 5, 1ms, [] {
    ++cycles;
    for (int line = 0; line < 20; ++line) std::printf("cycle %8d line %2d %080d\n", cycles, line, line);
  });
}
PLC_APPLICATION("Chatter", setup)
