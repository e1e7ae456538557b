// One tick releases tasks, each of which wakes the next; tasks come back, are interrupted and leave
// meanwhile.

#include <array>
#include <memory>

#include "schedulers/tick/tick_table.hpp"
#include "tests/models/checker/model.hpp"
#include "tests/models/model_clock.hpp"

namespace plchost::models {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(1);
constexpr std::size_t kTicks = 3;

struct Shared {
  ModelClock clock;
  TickTable table{clock};
  Task high{1, kTick};
  Task low{2, kTick};
  std::unique_ptr<ActivationSource> of_high;
  std::unique_ptr<ActivationSource> of_low;
  std::array<int, kTicks + 1> ticked{};  // plain: written before each tick

  Shared() {
    const FreewheelRule rule{SchedulerSettings{}};
    of_low = table.add(low, rule);
    of_high = table.add(high, rule);
    table.start(TimePoint{});
  }
  void tick(std::size_t number) {
    ticked[number] = 1;
    table.on_tick(TimePoint(kTick * static_cast<Duration::rep>(number)));
  }
  /// False: it was interrupted.
  bool run(Task& task, ActivationSource& source) {
    const std::optional<Activation> activation = source.wait();
    if (!activation) return false;
    const auto number = static_cast<std::size_t>(activation->release.time_since_epoch() / kTick);
    require(number < ticked.size() && ticked[number] == 1, "a task runs before its tick");
    task.ran();
    return true;
  }
};

Shared& make(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.table, "table");
  return shared;
}

void run_cycles(Shared& shared, Task& task, ActivationSource& source, int cycles) {
  for (int i = 0; i < cycles; ++i) require(shared.run(task, source), "interrupted by nobody");
}

// A task that the tick, or the task before it, forgets sleeps for ever.
void two_tasks_one_tick(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("tick", [&] { shared.tick(1); });
  scene.thread("high", [&] { run_cycles(shared, shared.high, *shared.of_high, 1); });
  scene.thread("low", [&] { run_cycles(shared, shared.low, *shared.of_low, 1); });
}

void one_task_three_ticks(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("tick", [&] {
    for (std::size_t i = 1; i <= 3; ++i) shared.tick(i);
  });
  scene.thread("high", [&] { run_cycles(shared, shared.high, *shared.of_high, 3); });
}

// The first of the tasks leaves because it is interrupted: the others are woken nevertheless.
void the_first_is_interrupted(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("tick", [&] { shared.tick(1); });
  scene.thread("high", [&] { (void)shared.run(shared.high, *shared.of_high); });
  scene.thread("low", [&] { run_cycles(shared, shared.low, *shared.of_low, 1); });
  scene.thread("control", [&] { shared.of_high->interrupt(); });
}

// It is interrupted, comes back for the same release, and gets it.
void one_is_interrupted_and_comes_back(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("tick", [&] {
    shared.tick(1);
    shared.tick(2);
  });
  scene.thread("high", [&] {
    for (int ran = 0; ran < 2;) ran += shared.run(shared.high, *shared.of_high) ? 1 : 0;
  });
  scene.thread("control", [&] { shared.of_high->interrupt(); });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"two_tasks_one_tick", two_tasks_one_tick},
              {"one_task_three_ticks", one_task_three_ticks},
              {"the_first_is_interrupted", the_first_is_interrupted},
              {"one_is_interrupted_and_comes_back", one_is_interrupted_and_comes_back}});
}
