// Tasks that lose cycles on demand, each for another reason.
#include <atomic>
#include <chrono>

#include "instances/plc_app.hpp"

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::atomic<int> own_ms{0};
std::atomic<int> variable_ms{0};

void spin(std::chrono::milliseconds time) {
  const auto end = Clock::now() + time;
  while (Clock::now() < end) {
  }
}

bool variable() {
  spin(std::chrono::milliseconds(variable_ms.exchange(0)));
  return false;
}

void setup(plc::Application& app) {
  app.cyclic("Loser", 8, 5ms, [] { spin(std::chrono::milliseconds(own_ms.exchange(0))); });
  app.external("Burst", 2, "burst", [] { spin(40ms); });
  app.external("Overrun", 9, "overrun", [] { own_ms = 40; });
  app.external("Variable", 9, "variable", [] { variable_ms = 40; });
  app.external("Relay", 9, "relay", [burst = app.open_event("burst")] { (void)burst.post(); });
  app.event("Edge", 3, variable, [] {});
}

}  // namespace

PLC_APPLICATION("Losses", setup)
