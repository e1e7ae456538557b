// Runs in a plc-instance whose variables are watched: each cycle changes all of them.

#include <array>
#include <string>

#include "instances/plc_app.hpp"
#include "tests/bench/watched_variables.hpp"

namespace {

std::array<int, plchost::bench::kWatchedVariables> values;

void setup(plc::Application& app) {
  app.cyclic("Cycle", 0, std::chrono::milliseconds(1), [] {
    for (int& value : values) ++value;
  });
  for (std::size_t i = 0; i < values.size(); ++i)
    app.variable("Bench.value_" + std::to_string(i), values.at(i), {"Cycle"});
}

}  // namespace

PLC_APPLICATION("BenchVariables", setup)
