// From the start of plc-instance (the call that spawns it) to the first cycle of its task. The floor is the
// start of the smallest program with a cycle in real time, in alternation, on the same core.

#include <csignal>
#include <cstdlib>
#include <thread>

#include <fmt/format.h>

#include "shm/files/memory_file.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/child.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/shared_board.hpp"
#include "tests/bench/start_board.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr auto kStartPatience = std::chrono::seconds(10);

Result<void> measure_one(const std::vector<std::string>& arguments, StartBoard& board, Samples& into) {
  board.first_cycle_ns.store(0);
  const TimePoint began = MonotonicClock::now();
  auto child = Child::start(arguments);
  if (!child) return std::unexpected(std::move(child.error()));
  while (board.first_cycle_ns.load() == 0) {
    if (MonotonicClock::now() - began > kStartPatience)
      return failure(ErrorCode::timed_out, arguments.front() + ": no cycle ran");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  into.push(TimePoint(Duration(board.first_cycle_ns.load())) - began);
  return {};
}

Result<Row> measure(const Plan& plan, const std::string& name, StartBoard& board) {
  const std::vector<std::string> ours{
      (plan.programs / "plc-instance").string(),
      "--name=start",
      "--pool=" + name,
      fmt::format("--core={}", plan.task_core),
      "--log-level=error",
      "--application=" + (plan.programs.parent_path() / "applications" / "bench_start.so").string()};
  const std::vector<std::string> floor{(plan.programs / "plchost-bench-start-floor").string()};
  Row row{.name = "start/plc-instance", .sample = "a start"};
  // An instance binds itself; the floor starts where it will stay.
  for (int i = 0; i < plan.starts; ++i) {
    {
      const OnCore child_inherits_it(plan.task_core);
      PLCHOST_TRY(measure_one(floor, board, row.floor));
    }
    PLCHOST_TRY(measure_one(ours, board, row.ours));
  }
  row.targets = {{"median below 20 ms", "ms", summarise(row.ours).p50 / 1e3, 20}};
  row.note = "the pool is there from the second start on, as under a manager";
  return row;
}

}  // namespace

Result<std::vector<Row>> measure_start(const Plan& plan) {
  const std::string name = own_name("bench");
  const std::string board_name = name + ".board";
  PLCHOST_TRY_ASSIGN(const auto memory, MemoryFile::replace(board_name, sizeof(StartBoard)));
  ::setenv(kBoardVariable, ("/dev/shm/" + board_name).c_str(), 1);
  auto row = measure(plan, name, *reinterpret_cast<StartBoard*>(memory.bytes().data()));
  MemoryFile::remove(board_name);
  ObjectPool::remove(name);
  if (!row) return std::unexpected(std::move(row.error()));
  return std::vector{std::move(*row)};
}

}  // namespace plchost::bench
