// An external event posted by another process, on another core and on the task's own, to the first
// instruction of the task's code. The floor is a raw futex wake between the same two cores, into a thread of
// the same priority.

#include <atomic>

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "schedulers/task_set.hpp"
#include "shm/base/futex.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/parts.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kPostProcessSlice = std::chrono::seconds(1);

/// Shared by the poster and the measured process.
struct PostBoard {
  std::atomic<std::int64_t> posted_ns{0};
  std::atomic<std::uint32_t> word{0};      // the floor's futex word
  std::atomic<std::uint32_t> answered{0};  // posts that arrived
};

enum class Kind : std::uint8_t { ours, floor };

/// From where to where posts go.
struct Setting {
  const Plan& plan;
  int poster_core;
  PostBoard& board;
  const std::string& pool;
  const PoolEvent& event;
};

void sleep_for(Duration duration) {
  const timespec time = to_timespec(duration);
  ::clock_nanosleep(CLOCK_MONOTONIC, 0, &time, nullptr);
}

/// The poster: a process of its own that posts, each time when the post before has arrived.
int run_poster(const Setting& setting, Kind kind, std::int64_t posts) {
  if (!bind_thread({setting.poster_core})) return 1;
  auto pool = ObjectPool::attach(setting.pool);
  if (!pool) return 1;
  const auto event = pool->open_event("bench/ping");
  if (!event) return 1;
  PostBoard& board = setting.board;
  for (std::int64_t i = 0; i < posts; ++i) {
    const std::uint32_t before = board.answered.load();
    sleep_for(setting.plan.post_gap);
    board.posted_ns.store(MonotonicClock::now().time_since_epoch().count());
    if (kind == Kind::ours) {
      (void)event->post();
    } else {
      board.word.fetch_add(1, std::memory_order_release);
      futex_wake(&board.word);
    }
    for (int waited = 0; board.answered.load() == before && waited < 1000; ++waited)
      sleep_for(setting.plan.post_gap);
  }
  return 0;
}

Duration since(const PostBoard& board) {
  return MonotonicClock::now() - TimePoint(Duration(board.posted_ns.load(std::memory_order_relaxed)));
}

/// Runs a poster to its end.
Result<void> post(const Setting& setting, Kind kind, std::int64_t posts) {
  const pid_t poster = ::fork();
  if (poster < 0) return failure(ErrorCode::system, "fork", errno);
  if (poster == 0) ::_exit(run_poster(setting, kind, posts));
  int status = 0;
  if (::waitpid(poster, &status, 0) != poster || status != 0)
    return failure(ErrorCode::system, "the poster failed");
  return {};
}

Result<void> run_floor(const Setting& setting, Duration slice, Samples& into) {
  const auto posts = slice / setting.plan.post_gap;
  PostBoard& board = setting.board;
  Samples samples(static_cast<std::size_t>(posts));
  std::atomic<bool> stop{false};
  std::uint32_t seen = board.word.load();
  auto thread = Thread::start("floor", kPriority, [&] {
    for (;;) {
      while (board.word.load(std::memory_order_acquire) == seen) futex_wait(&board.word, seen);
      if (stop.load()) return;
      samples.add(since(board));
      seen = board.word.load();
      board.answered.fetch_add(1);
    }
  });
  if (!thread) return std::unexpected(std::move(thread.error()));
  auto done = post(setting, Kind::floor, posts);
  stop.store(true);
  board.word.fetch_add(1);
  futex_wake(&board.word);
  thread->join();
  into.append(samples);
  return done;
}

Result<void> run_ours(const Setting& setting, Duration slice, Samples& into) {
  const auto posts = slice / setting.plan.post_gap;
  Samples samples(static_cast<std::size_t>(posts));
  LinuxClock clock;
  const auto statistics = std::make_unique<TaskStatistics>();
  TaskConfig task;
  task.name = "ping";
  task.kind = TaskKind::external;
  task.external_event = "ping";
  task.entry = [&] {
    samples.add(since(setting.board));
    setting.board.answered.fetch_add(1);
  };
  TaskEnvironment environment;
  environment.find_event = [&](std::string_view) -> Result<CountedEvent*> {
    return &setting.event.counted();
  };
  environment.statistics = [&](std::size_t) -> TaskStatistics& { return *statistics; };
  PLCHOST_TRY_ASSIGN(const auto tasks, TaskSet::create(clock, PriorityBand::normal, {task}, environment));
  if (auto started = tasks->start("CmpSchedule", {}); !started) return started;
  if (auto done = post(setting, Kind::ours, posts); !done) return done;
  if (auto stopped = tasks->stop(std::chrono::seconds(5)); !stopped) return stopped;
  into.append(samples);
  return {};
}

Result<Row> measure(const Setting& setting, std::string name) {
  Row row{.name = std::move(name), .sample = "a post"};
  // The process's other thread sleeps meanwhile; the measured ones inherit this core.
  const OnCore threads_inherit_it(setting.plan.task_core);
  auto done = alternate(setting.plan,
                        {[&](Duration slice) { return run_floor(setting, slice, row.floor); },
                         [&](Duration slice) { return run_ours(setting, slice, row.ours); }},
                        kPostProcessSlice);
  if (!done) return std::unexpected(std::move(done.error()));
  row.targets = {{"median below 1.15 x a raw futex wake", "us", summarise(row.ours).p50,
                  1.15 * summarise(row.floor).p50}};
  return row;
}

}  // namespace

Result<std::vector<Row>> measure_post_process(const Plan& plan) {
  void* memory =
      ::mmap(nullptr, sizeof(PostBoard), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return failure(ErrorCode::system, "mmap", errno);
  auto* board = new (memory) PostBoard;
  const std::string name = own_name("bench");
  PLCHOST_TRY_ASSIGN(auto pool, ObjectPool::create(name));
  auto event = pool.create_event("bench/ping");
  if (!event || !event->set_registered(true)) return failure(ErrorCode::full, "no event in the pool");
  std::vector<Row> rows;
  Result<void> done;
  for (const auto& [core, from] :
       {std::pair(plan.poster_core, "other-core"), std::pair(plan.task_core, "same-core")}) {
    auto row = measure({plan, core, *board, name, *event}, fmt::format("post/process/{}", from));
    if (!row) {
      done = std::unexpected(std::move(row.error()));
      break;
    }
    rows.push_back(std::move(*row));
  }
  ObjectPool::remove(name);
  ::munmap(memory, sizeof(PostBoard));
  if (!done) return std::unexpected(std::move(done.error()));
  return rows;
}

}  // namespace plchost::bench
