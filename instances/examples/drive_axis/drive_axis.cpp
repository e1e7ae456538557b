// A drive axis that moves a carriage to and fro, controlled every millisecond.
//
//   Position  cyclic, 1 ms    trajectory, servo cascade, following error
//   Sequence  cyclic, 20 ms   where to go next
//   Fault     event           once when the following error leaves its window: counts, and holds the axis
//   Reset     external event  "reset" clears the fault
//   Report    cyclic, 1 s     one line of figures; not real-time

#include <atomic>
#include <cmath>

#include "axis.hpp"
#include "plc_app.hpp"

namespace {

using namespace std::chrono_literals;

constexpr auto kInterval = 1ms;
constexpr double kStroke = 1.0;         // m
constexpr double kWindow = 0.002;       // m of following error
constexpr double kInPosition = 0.0001;  // m

// The signals between the tasks; each has one writer but `held`, which Fault sets and Reset clears.
std::atomic<double> target{kStroke};           // m, Sequence
std::atomic<double> actual{0.0};               // m, Position
std::atomic<double> following_error{0.0};      // m, Position
std::atomic<double> max_following_error{0.0};  // m, Position
std::atomic<bool> outside_window{false};       // Position
std::atomic<bool> held{false};
std::atomic<unsigned> moves{0};   // Sequence
std::atomic<unsigned> faults{0};  // Fault

void position() {
  static Carriage carriage;
  static Trajectory trajectory;
  static Servo servo;
  const double seconds = std::chrono::duration<double>(kInterval).count();

  const double error = trajectory.position() - carriage.position();
  actual = carriage.position();
  following_error = error;
  if (std::fabs(error) > max_following_error) max_following_error = std::fabs(error);
  outside_window = std::fabs(error) > kWindow;

  carriage.step(seconds, servo.step(seconds, trajectory, carriage));
  trajectory.step(seconds, held ? trajectory.position() : target.load());
}

void sequence() {
  if (held || std::fabs(actual - target) > kInPosition) return;
  target = target > 0.0 ? 0.0 : kStroke;
  ++moves;
}

void fault() {
  held = true;
  ++faults;
}

void reset() {
  held = false;
}

void report() {
  const auto um = [](double metres) { return static_cast<int>(std::lround(metres * 1e6)); };
  plc::log("position %d um, following error %d um (largest %d um), moves %u, faults %u%s", um(actual),
           um(following_error), um(max_following_error), moves.load(), faults.load(), held ? ", held" : "");
}

void setup(plc::Application& app) {
  app.cyclic("Position", 0, kInterval, position);
  app.event("Fault", 1, [] { return outside_window.load(); }, fault);
  app.external("Reset", 2, "reset", reset);
  app.cyclic("Sequence", 3, 20ms, sequence);
  app.cyclic("Report", 20, 1s, report);
  app.variable("Axis.target", target);
  app.variable("Axis.actual", actual, {"Position"});
  app.variable("Axis.following_error", following_error, {"Position"});
  app.variable("Axis.max_following_error", max_following_error, {"Position"});
  app.variable("Axis.outside_window", outside_window, {"Position"});
  app.variable("Axis.held", held);
  app.variable("Axis.moves", moves);
  app.variable("Axis.faults", faults);
}

}  // namespace

PLC_APPLICATION("DriveAxis", setup)
