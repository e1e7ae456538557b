// Runs in a real instance: stamps the first instruction of the task that an external event activates.

#include "instances/plc_app.hpp"
#include "shm/base/time.hpp"
#include "tests/bench/dds_board.hpp"
#include "tests/bench/shared_board.hpp"

namespace {

void setup(plc::Application& app) {
  auto& board = plchost::bench::open_board<plchost::bench::DdsBoard>();
  app.external("Ping", 0, "ping",
               [&board] { board.record(plchost::MonotonicClock::now().time_since_epoch().count()); });
}

}  // namespace

PLC_APPLICATION("BenchProbe", setup)
