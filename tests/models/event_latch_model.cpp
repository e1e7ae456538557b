// Each edge of an event task's variable becomes a run or is counted as lost, and the task does not sleep over
// one.

#include "schedulers/tasks/event_latch.hpp"
#include "tests/models/checker/model.hpp"
#include "tests/models/model_clock.hpp"

namespace plchost::models {
namespace {

struct Shared {
  ModelClock clock;
  EventLatch latch;
  int written = 0;  // plain: by the thread that raises an edge, for the run
  std::uint64_t edges = 0;
  std::uint64_t runs = 0;
  std::uint64_t lost = 0;

  void end_polls() { latch.gate.interrupt(clock); }
};

constexpr TimePoint poll_time(int number) {
  return TimePoint(std::chrono::seconds(number));
}

/// As the source of an event task does it. Ends by the interrupt, which comes after the last poll.
void run_for_edges(Shared& shared) {
  TimePoint last{};
  for (;;) {
    if (const auto seen = shared.latch.take()) {
      require(*seen >= poll_time(1) && *seen >= last, "a run is for an edge that was never seen");
      last = *seen;
      ++shared.runs;
      shared.lost += shared.latch.take_lost();
    } else if (shared.latch.gate.wait(shared.clock) != ActivationGate::Outcome::opened) {
      return;
    }
  }
}

void check(Shared& shared) {
  require(!shared.latch.is_due(), "a run that is due does not begin");
  require(shared.runs + shared.lost + shared.latch.take_lost() == shared.edges,
          "an edge is neither a run nor counted as lost");
}

Shared& make(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.latch, "latch");
  scene.name(shared.written, "written");
  return shared;
}

void edges_of_a_variable(Scene& scene) {
  Shared& shared = make(scene);
  shared.latch.prime(false);
  scene.thread("poller", [&] {
    int poll = 1;
    for (const bool level : {true, false, true}) {
      if (shared.latch.poll(shared.clock, level, poll_time(poll++))) ++shared.edges;
    }
    shared.end_polls();
  });
  scene.thread("task", [&] { run_for_edges(shared); });
  scene.at_end([&] {
    require(shared.edges == 2, "an edge was not seen");
    check(shared);
    observe(static_cast<unsigned>(shared.edges - shared.runs));
  });
  scene.outcomes(3);  // the task runs for both edges, or comes too late for the second one
}

void edges_raised_by_calls(Scene& scene) {
  Shared& shared = make(scene);
  for (const char* name : {"application", "its other thread"}) {
    scene.thread(name, [&] { shared.latch.raise(); });
  }
  scene.thread("poller", [&] {
    for (int poll = 1; poll <= 3; ++poll)
      shared.edges += shared.latch.poll_raised(shared.clock, poll_time(poll), 2);
    shared.end_polls();
  });
  scene.thread("task", [&] { run_for_edges(shared); });
  scene.at_end([&] { check(shared); });
}

void a_run_sees_what_was_written(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("application", [&] {
    shared.written = 7;
    shared.latch.raise();
  });
  scene.thread("poller", [&] {
    for (int poll = 1; poll <= 2; ++poll) shared.latch.poll_raised(shared.clock, poll_time(poll), 1);
    shared.end_polls();
  });
  scene.thread("task", [&] {
    do {
      if (!shared.latch.take()) continue;
      require(shared.written == 7, "a run does not see what was written before its edge");
      return;
    } while (shared.latch.gate.wait(shared.clock) == ActivationGate::Outcome::opened);
  });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"a_run_sees_what_was_written", a_run_sees_what_was_written},
              {"edges_of_a_variable", edges_of_a_variable},
              {"edges_raised_by_calls", edges_raised_by_calls}});
}
