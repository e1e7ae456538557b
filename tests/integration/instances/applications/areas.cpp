// Areas of each kind. Two tasks of different priority write one output area, each word of its half with the
// number of its cycle. Both look whether inputs and the other's outputs are whole, and count in the retain
// area.
#include <algorithm>
#include <array>
#include <cstdint>

#include "../../../../instances/plc_app.hpp"

using namespace std::chrono_literals;

namespace {

constexpr std::size_t kWords = 256;
using Words = std::array<std::uint64_t, kWords>;

struct Outputs {
  Words fast;
  Words slow;
};
/// Equal at the end of each cycle of the fast task.
struct Kept {
  std::uint64_t begun;
  std::uint64_t done;
};

plc::Area<Words> inputs;
plc::Area<Outputs> outputs;
plc::Area<Kept> kept;
plc::Area<std::uint64_t> persistent;
plc::Area<std::uint64_t> data;
unsigned long torn = 0;
unsigned long seen = 0;
unsigned long prepared = 0;
unsigned long prepared_with = 0;

bool is_whole(const Words& words) {
  return std::all_of(words.begin(), words.end(), [&](std::uint64_t word) { return word == words[0]; });
}

void look(const Words& others) {
  const std::uint64_t at_start = (*inputs)[0];
  if (!is_whole(*inputs) || !is_whole(others)) ++torn;
  const auto end = plc::system_time() + 100us;
  while (plc::system_time() < end) {
  }
  if (!is_whole(*inputs) || (*inputs)[0] != at_start || !is_whole(others)) ++torn;
  seen = at_start;
}

void fast() {
  ++kept->begun;
  look(outputs->slow);
  for (std::uint64_t& word : outputs->fast) ++word;
  ++kept->done;
  ++*persistent;
  ++*data;
}

void slow() {
  look(outputs->fast);
  for (std::uint64_t& word : outputs->slow) {
    ++word;
    const auto end = plc::system_time() + 4us;
    while (plc::system_time() < end) {
    }
  }
}

void report() {
  const Plc_Area_State in = inputs.state();
  const Plc_Area_State out = outputs.state();
  const Plc_Area_State keep = kept.state();
  plc::log(
      "torn %lu input %lu missed %lu late %lu begun %lu persistent %lu data %lu origin %u saves %lu prepared "
      "%lu with %lu",
      torn, seen, in.qwMissed, out.qwMissed, kept->begun, *persistent, *data, keep.dwOrigin, keep.qwSaves,
      prepared, prepared_with);
}

void prepare(unsigned /*event*/, const EVTPARAM_ExternalEventTask* /*parameter*/, void* /*user*/) {
  ++prepared;
  prepared_with = kept->begun;
}

void setup(plc::Application& app) {
  EventRegisterCallbackFunction(EVT_PrepareStart, prepare, nullptr);
  app.cyclic("Fast", 1, 1ms, fast);
  app.cyclic("Slow", 10, 10ms, slow);
  app.external("Report", 20, "report", report);
  inputs = app.area<Words>("inputs", PLC_AREA_INPUT, {}, {{{"Fast"}, {"Slow"}}});
  outputs = app.area<Outputs>("outputs", PLC_AREA_OUTPUT, {},
                              {{{"Fast", 0, sizeof(Words)}, {"Slow", sizeof(Words), sizeof(Words)}}});
  kept = app.area<Kept>("kept", PLC_AREA_RETAIN, Kept{100, 100}, {{{"Fast"}}, LAYOUT});
  persistent = app.area<std::uint64_t>("persistent", PLC_AREA_PERSISTENT, 100, {{{"Fast"}}});
  data = app.area<std::uint64_t>("data", PLC_AREA_DATA | 0x8000, 100);
}

}  // namespace

PLC_APPLICATION("Areas", setup)
