// A bottling line: bottles are filled by weight in two stages, capped, and moved on.
//
//   Fill      cyclic, 10 ms   dosing: coarse, fine, settle; learns the valve's after-run
//   Conveyor  cyclic, 50 ms   moves the capped bottle on and brings an empty one
//   Cap       event           once for each bottle that becomes full (BOOL from FALSE to TRUE)
//   Stop      external event  "stop" halts the line at once, the next "stop" lets it go on
//   Report    cyclic, 1 s     one line of figures; not real-time
//
// All tasks run on one core, ordered by priority: values that two of them share are atomic, and each value
// has one writer.

#include <atomic>
#include <cmath>

#include "plant.hpp"
#include "plc_app.hpp"

namespace {

using namespace std::chrono_literals;

constexpr double kTarget = 500.0;     // g
constexpr double kFineBefore = 60.0;  // g before the target: change to the fine stage
constexpr auto kFillInterval = 10ms;
constexpr int kSettleCycles = 40;  // 400 ms until the scale stands still
constexpr int kMoveCycles = 8;     // 400 ms for one bottle's way

enum class Stage { idle, coarse, fine, settle };

// The signals between the tasks.
std::atomic<bool> halted{false};       // Stop
std::atomic<bool> bottle_there{true};  // Conveyor
std::atomic<bool> bottle_full{false};  // Fill
std::atomic<unsigned> capped{0};       // Cap
std::atomic<unsigned> stops{0};        // Stop
std::atomic<int> last_weight_mg{0};    // Fill
std::atomic<int> after_run_mg{0};      // Fill

void fill() {
  static FillingStation station;
  static Stage stage = Stage::idle;
  static int settling = 0;
  static double after_run = 4.0;  // g, learned
  const double seconds = std::chrono::duration<double>(kFillInterval).count();

  const bool may_dose = !halted;
  station.step(seconds, may_dose && stage == Stage::coarse, may_dose && stage == Stage::fine);
  switch (stage) {
    case Stage::idle:
      if (!bottle_there || bottle_full) {
        if (!bottle_there) bottle_full = false;  // it has left
        break;
      }
      station.place_empty_bottle();
      stage = Stage::coarse;
      break;
    case Stage::coarse:
      if (station.weight() >= kTarget - kFineBefore) stage = Stage::fine;
      break;
    case Stage::fine:
      if (station.weight() < kTarget - after_run) break;
      stage = Stage::settle;
      settling = kSettleCycles;
      break;
    case Stage::settle:
      if (--settling > 0) break;
      after_run += 0.3 * (station.weight() - kTarget);  // too much: close earlier next time
      last_weight_mg = static_cast<int>(std::lround(station.weight() * 1000.0));
      after_run_mg = static_cast<int>(std::lround(after_run * 1000.0));
      bottle_full = true;
      stage = Stage::idle;
      break;
  }
}

void cap() {
  ++capped;
}

void conveyor() {
  static unsigned moved = 0;
  static int moving = 0;
  if (halted) return;
  if (moving > 0) {
    bottle_there = --moving == 0;
  } else if (capped != moved) {
    moved = capped;
    moving = kMoveCycles;
    bottle_there = false;
  }
}

void stop() {
  halted = !halted;
  ++stops;
}

void report() {
  const int weight = last_weight_mg;
  const int run = after_run_mg;
  plc::log("bottles %u, last %d.%03d g of 500 g, after-run %d.%03d g, stops %u%s", capped.load(),
           weight / 1000, weight % 1000, run / 1000, run % 1000, stops.load(), halted ? ", halted" : "");
}

void setup(plc::Application& app) {
  app.external("Stop", 0, "stop", stop);
  app.cyclic("Fill", 1, kFillInterval, fill);
  app.event("Cap", 2, [] { return bottle_full.load(); }, cap);
  app.cyclic("Conveyor", 3, 50ms, conveyor);
  app.cyclic("Report", 20, 1s, report);
  app.variable("Line.halted", halted);
  app.variable("Line.bottle_there", bottle_there);
  app.variable("Line.bottle_full", bottle_full);
  app.variable("Line.capped", capped);
  app.variable("Line.stops", stops);
  app.variable("Fill.last_weight_mg", last_weight_mg, {"Fill"});
  app.variable("Fill.after_run_mg", after_run_mg, {"Fill"});
}

}  // namespace

PLC_APPLICATION("BottlingLine", setup)
