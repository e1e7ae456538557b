// An external event posted by another process on another core, to the first instruction of the task's code.
// The floor is a raw futex wake between the same two cores, into a thread of the same priority.

#include <atomic>

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "schedulers/task_set.hpp"
#include "shm/base/futex.hpp"
#include "shm/base/system_call.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/bench.hpp"

namespace plchost::bench {

namespace {

/// Shared by the poster and the measured process.
struct Board {
  std::atomic<std::int64_t> posted_ns{0};
  std::atomic<std::uint32_t> word{0};      // the floor's futex word
  std::atomic<std::uint32_t> answered{0};  // posts that arrived
};

enum class Kind : std::uint8_t { ours, floor };

void sleep_for(Duration duration) {
  const timespec time = to_timespec(duration);
  ::clock_nanosleep(CLOCK_MONOTONIC, 0, &time, nullptr);
}

/// The poster: a process of its own that posts `posts` times, each when the one before has arrived.
int run_poster(const Plan& plan, Kind kind, Board& board, const std::string& pool_name) {
  if (!bind_thread(plan.poster_core)) return 1;
  auto pool = ObjectPool::attach(pool_name);
  if (!pool) return 1;
  const auto event = pool->open_event("bench/ping");
  if (!event) return 1;
  for (int i = 0; i < plan.posts; ++i) {
    const std::uint32_t before = board.answered.load();
    sleep_for(plan.gap);
    board.posted_ns.store(MonotonicClock::now().time_since_epoch().count());
    if (kind == Kind::ours) {
      (void)event->post();
    } else {
      board.word.fetch_add(1, std::memory_order_release);
      futex_wake(&board.word);
    }
    for (int waited = 0; board.answered.load() == before && waited < 1000; ++waited) sleep_for(plan.gap);
  }
  return 0;
}

Duration since(const Board& board) {
  return MonotonicClock::now() - TimePoint(Duration(board.posted_ns.load(std::memory_order_relaxed)));
}

Result<void> wait_for(pid_t poster) {
  int status = 0;
  if (::waitpid(poster, &status, 0) != poster || status != 0)
    return failure(ErrorCode::system, "the poster failed");
  return {};
}

Result<pid_t> fork_poster(const Plan& plan, Kind kind, Board& board, const std::string& pool) {
  const pid_t child = ::fork();
  if (child < 0) return failure(ErrorCode::system, "fork", errno);
  if (child == 0) ::_exit(run_poster(plan, kind, board, pool));
  return child;
}

Result<void> run_floor(const Plan& plan, Board& board, const std::string& pool, Samples& into) {
  Samples samples(static_cast<std::size_t>(plan.posts));
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
  if (!thread) return std::unexpected(thread.error());
  const auto poster = fork_poster(plan, Kind::floor, board, pool);
  auto done = poster ? wait_for(*poster) : Result<void>(std::unexpected(poster.error()));
  stop.store(true);
  board.word.fetch_add(1);
  futex_wake(&board.word);
  thread->join();
  into.append(samples);
  return done;
}

Result<void> run_ours(const Plan& plan, Board& board, const std::string& pool, const PoolEvent& event,
                      Samples& into) {
  Samples samples(static_cast<std::size_t>(plan.posts));
  LinuxClock clock;
  TaskStatistics statistics;
  TaskConfig task;
  task.name = "ping";
  task.kind = TaskKind::external;
  task.external_event = "ping";
  task.entry = [&] {
    samples.add(since(board));
    board.answered.fetch_add(1);
  };
  TaskEnvironment environment;
  environment.find_event = [&](std::string_view) -> Result<CountedEvent*> { return &event.counted(); };
  environment.statistics = [&](std::size_t) -> TaskStatistics& { return statistics; };
  auto tasks = TaskSet::create(clock, PriorityBand::normal, {task}, environment);
  if (!tasks) return std::unexpected(tasks.error());
  if (auto started = (*tasks)->start("CmpSchedule", {}); !started) return started;
  const auto poster = fork_poster(plan, Kind::ours, board, pool);
  if (!poster) return std::unexpected(poster.error());
  if (auto done = wait_for(*poster); !done) return done;
  if (auto stopped = (*tasks)->stop(std::chrono::seconds(5)); !stopped) return stopped;
  into.append(samples);
  return {};
}

}  // namespace

Result<std::vector<Row>> measure_post_process(const Plan& plan) {
  if (auto bound = bind_thread(plan.task_core); !bound) return std::unexpected(bound.error());
  void* memory = ::mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return failure(ErrorCode::system, "mmap", errno);
  auto* board = new (memory) Board;
  const std::string name = fmt::format("plchost-bench-{}", ::getpid());
  auto pool = ObjectPool::create(name);
  if (!pool) return std::unexpected(pool.error());
  auto event = pool->create_event("bench/ping");
  if (!event || !event->set_registered(true)) return failure(ErrorCode::full, "no event in the pool");
  std::vector<Row> rows(1);
  rows[0].name = "post/process";
  plan.progress("posts from another process, beside a raw futex");
  Result<void> done;
  for (int slice = 0; done && slice < plan.slices / 2; ++slice) {
    done = run_floor(plan, *board, name, rows[0].floor);
    if (done) done = run_ours(plan, *board, name, *event, rows[0].ours);
  }
  ObjectPool::remove(name);
  ::munmap(memory, sizeof(Board));
  if (!done) return std::unexpected(done.error());
  return rows;
}

}  // namespace plchost::bench
