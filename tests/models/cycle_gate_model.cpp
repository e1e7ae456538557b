// The control thread's moment in which no thread is in code of the application.

#include "schedulers/faults/cycle_gate.hpp"
#include "tests/models/checker/model.hpp"
#include "tests/models/model_clock.hpp"

namespace plchost::models {
namespace {

struct Shared {
  ModelClock clock;
  CycleGate gate;
  CycleGate::Seat seat;
  CycleGate::Seat other_seat;
  int state = 0;  // plain: of the application, and of a reader while the gate is closed
  int other_state = 0;
  std::atomic<std::uint32_t> nobody_wakes{0};
  bool looked = false;
  bool half = false;  // plain, as state
  int seen = 0;
};

constexpr TimePoint kStart{std::chrono::seconds(1000)};

Shared& make(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.gate, "gate");
  scene.name(shared.seat, "seat");
  scene.name(shared.other_seat, "other seat");
  scene.name(shared.state, "state");
  return shared;
}

void run_cycles(Shared& shared, CycleGate::Seat& seat, int& state, int cycles) {
  for (int i = 0; i < cycles; ++i) {
    const CycleGate::Stay within(&shared.gate, seat, shared.clock);
    ++state;
  }
}

// The parts of a cycle, which are in the seat's word, too: code of the application, then work of the runtime.
void run_cycle_in_parts(Shared& shared) {
  const CycleGate::Stay within(&shared.gate, shared.seat, shared.clock);
  shared.seat.code_begins(kStart);
  ++shared.state;
  shared.seat.part_ends();
  ++shared.state;
  shared.seat.work_begins();
  ++shared.state;
  shared.seat.part_ends();
  ++shared.state;
}

// A data race on what the cycles use is a cycle in the moment.
void look(Shared& shared) {
  shared.gate.close();
  if (!shared.seat.taken() && !shared.other_seat.taken()) {
    ++shared.state;
    ++shared.other_state;
    shared.looked = true;
  }
  shared.gate.open(shared.clock);
}

void two_tasks_one_look(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("task", [&] { run_cycles(shared, shared.seat, shared.state, 1); });
  scene.thread("other task", [&] { run_cycles(shared, shared.other_seat, shared.other_state, 1); });
  scene.thread("control", [&] { look(shared); });
  scene.at_end([&] {
    require(shared.state == (shared.looked ? 2 : 1), "a cycle or a look is lost");
    observe(shared.looked ? 1 : 0);
  });
  scene.outcomes(3);  // the look succeeds in some executions, and in some it does not
}

void two_cycles_two_looks(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("task", [&] { run_cycles(shared, shared.seat, shared.state, 2); });
  scene.thread("control", [&] {
    look(shared);
    look(shared);
  });
}

// The control thread has its moment also if a task waits for its end: it sleeps until nothing else can run.
void a_task_waits_at_the_gate(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.deadlines_rescue = true});
  scene.thread("task", [&] { run_cycles(shared, shared.seat, shared.state, 1); });
  scene.thread("control", [&] {
    shared.gate.close();
    shared.clock.wait(shared.nobody_wakes, 0, kStart);
    require(!shared.seat.taken(), "a task that waits at the gate has taken its seat");
    ++shared.state;
    shared.gate.open(shared.clock);
  });
  scene.at_end([&] { require(shared.state == 2, "a cycle or a look is lost"); });
}

void parts_of_a_cycle_one_look(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("task", [&] { run_cycle_in_parts(shared); });
  scene.thread("control", [&] { look(shared); });
  scene.at_end([&] {
    require(shared.state == (shared.looked ? 5 : 4), "a part or a look is lost");
    observe(shared.looked ? 1 : 0);
  });
  scene.outcomes(3);
}

// The supervision looks at the word while it changes.
void parts_of_a_cycle_seen(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("task", [&] { run_cycle_in_parts(shared); });
  scene.thread("supervision", [&] {
    const bool worked = shared.seat.at_work();
    const auto since = shared.seat.code_since();
    require(!since || *since == kStart, "code runs since a time that nobody has given");
    require(!(worked && since), "the code comes after the work");
    shared.seen = worked ? 2 : since ? 1 : 0;
  });
  scene.at_end([&] {
    require(!shared.seat.taken(), "the seat is taken after the cycle");
    observe(static_cast<unsigned>(shared.seen));
  });
  scene.outcomes(7);
}

// A debugger halts the task in the middle of its cycle: a look finds that, or a whole cycle, or none.
void a_cycle_that_stands_still(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("task", [&] {
    const CycleGate::Stay within(&shared.gate, shared.seat, shared.clock);
    shared.seat.code_begins(kStart);
    shared.half = true;
    const TimePoint start = shared.seat.stands_still();
    require(start == kStart, "code stands still that has begun at another time");
    shared.seat.goes_on(&shared.gate, shared.clock, start);
    shared.half = false;
    shared.seat.part_ends();
  });
  scene.thread("control", [&] {
    shared.gate.close();
    if (!shared.seat.taken()) {
      require(shared.seat.is_still() == shared.half, "a look takes half a cycle for a whole one");
      shared.seen = shared.half ? 2 : 1;
    }
    shared.gate.open(shared.clock);
  });
  scene.at_end([&] {
    require(!shared.seat.taken(), "the seat is taken after the cycle");
    observe(static_cast<unsigned>(shared.seen));
  });
  scene.outcomes(7);
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"two_tasks_one_look", two_tasks_one_look},
              {"two_cycles_two_looks", two_cycles_two_looks},
              {"a_task_waits_at_the_gate", a_task_waits_at_the_gate},
              {"parts_of_a_cycle_one_look", parts_of_a_cycle_one_look},
              {"parts_of_a_cycle_seen", parts_of_a_cycle_seen},
              {"a_cycle_that_stands_still", a_cycle_that_stands_still}});
}
