// Runs in a plc-instance whose start is measured: stamps its first cycle.

#include "instances/plc_app.hpp"
#include "shm/base/time.hpp"
#include "tests/bench/shared_board.hpp"
#include "tests/bench/start_board.hpp"

namespace {

void setup(plc::Application& app) {
  auto& board = plchost::bench::open_board<plchost::bench::StartBoard>();
  app.cyclic("Cycle", 0, std::chrono::milliseconds(1),
             [&board] { board.record(plchost::MonotonicClock::now().time_since_epoch().count()); });
}

}  // namespace

PLC_APPLICATION("BenchStart", setup)
