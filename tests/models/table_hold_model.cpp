// Breakpoints that are exchanged while tasks look at them.

#include <array>

#include "instances/runtime/debug/table_hold.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

struct Table {
  int number = 0;  // plain: of those who hold it, and of the one who frees it
};

struct Shared {
  std::array<Table, 3> tables{Table{1}, Table{2}, Table{3}};
  std::atomic<const Table*> current{nullptr};
  TableHold<Table> hold;
  TableHold<Table> other_hold;
  bool freed = false;
  int seen = 0;
};

Shared& make(Scene& scene) {
  auto& shared = scene.make<Shared>();
  shared.current.store(&shared.tables[0], std::memory_order_relaxed);
  scene.name(shared.current, "current");
  scene.name(shared.hold, "hold");
  scene.name(shared.other_hold, "other hold");
  scene.name(shared.tables, "tables");
  return shared;
}

// A data race on a table is a look at one that was freed.
int look(Shared& shared, TableHold<Table>& hold) {
  int seen = 0;
  if (const Table* const table = hold.take(shared.current)) seen = table->number;
  hold.let_go();
  return seen;
}

void exchange(Shared& shared, Table* before, const Table* next) {
  shared.current.store(next, std::memory_order_seq_cst);
  if (shared.hold.holds(before) || shared.other_hold.holds(before)) return;
  before->number = -1;
  shared.freed = true;
}

void two_looks_one_exchange(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("task", [&] {
    shared.seen = look(shared, shared.hold);
    const int again = look(shared, shared.hold);
    require(again >= shared.seen, "a look goes back to the table before");
  });
  scene.thread("control", [&] { exchange(shared, &shared.tables[0], &shared.tables[1]); });
  scene.at_end([&] {
    require(shared.seen == 1 || shared.seen == 2, "a task has seen a table that is none");
    observe(shared.freed ? 1 : 0);
  });
  scene.outcomes(3);  // in some executions the task holds the table, and it is freed later
}

void two_tasks_one_exchange(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("task", [&] { require(look(shared, shared.hold) > 0, "the task has seen a freed table"); });
  scene.thread("other task",
               [&] { require(look(shared, shared.other_hold) > 0, "the task has seen a freed table"); });
  scene.thread("control", [&] { exchange(shared, &shared.tables[0], &shared.tables[1]); });
}

void one_look_two_exchanges(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("task", [&] { require(look(shared, shared.hold) >= 0, "the task has seen a freed table"); });
  scene.thread("control", [&] {
    exchange(shared, &shared.tables[0], &shared.tables[1]);
    exchange(shared, &shared.tables[1], nullptr);
  });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"two_looks_one_exchange", two_looks_one_exchange},
              {"two_tasks_one_exchange", two_tasks_one_exchange},
              {"one_look_two_exchanges", one_look_two_exchanges}});
}
