// The longest wait of a living client of a large pool while others are killed inside of its calls, and while
// their objects are freed.

#include <atomic>
#include <functional>
#include <string>

#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/bench/child.hpp"
#include "tests/bench/parts.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

namespace {

constexpr std::uint32_t kObjectsOfPlan =
    9;  // times as many as Plan::objects, in a pool for ten times as many
constexpr std::size_t kLarge = std::size_t{4} << 30;
constexpr Duration kBound = std::chrono::milliseconds(100);

/// A process of its own that does `body`; killed when this goes, or with its parent.
class Killed {
 public:
  explicit Killed(const std::function<void()>& body) {
    const pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ != 0) return;
    end_with(parent, SIGKILL);
    body();
    ::_exit(0);
  }
  Killed(const Killed&) = delete;
  Killed& operator=(const Killed&) = delete;
  ~Killed() { end(); }
  void end() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_ = 0;
};

[[noreturn]] void storm(const std::string& name, std::uint32_t objects) {
  auto pool = ObjectPool::attach(name);
  for (unsigned i = 0; pool; ++i) {
    (void)pool->create_semaphore("storm" + std::to_string(i % 7), 1);
    (void)pool->create_memory("memory" + std::to_string(i % 3), 4096);
    (void)pool->open_semaphore(std::to_string(i % objects));
  }
  ::_exit(1);
}

/// Kills one after the other, each at another moment.
[[noreturn]] void kill_many(const std::string& name, std::uint32_t objects) {
  for (unsigned i = 0;; ++i) {
    const Killed victim([&] { storm(name, objects); });
    ::usleep(500 + 37 * (i % 61));
  }
}

Row row_of(std::string name, Samples waits, std::string note, bool to_hold = true) {
  Row row{.name = std::move(name), .sample = "a call", .ours = std::move(waits), .note = std::move(note)};
  if (row.ours.size() == 0) row.note += "; not measured: it could not be made";
  if (to_hold) {
    row.targets = {{"no wait above 100 ms", "us", summarise(row.ours).max, to_us(kBound), true}};
  }
  return row;
}

template <class Call>
Result<Samples> wait_for(Duration time, Call call) {
  Samples samples(1'000'000);
  const TimePoint end = MonotonicClock::now() + time;
  for (TimePoint now = MonotonicClock::now(); now < end;) {
    const TimePoint began = now;
    if (!call()) return failure(ErrorCode::system, "a call of the living client failed");
    now = MonotonicClock::now();
    samples.add(now - began);
  }
  return samples;
}

/// While a child that holds what `hold` made is killed, and for a second more. Nothing if it could not make
/// it.
Result<Samples> wait_for_the_end_of(ObjectPool& pool, const std::function<bool(ObjectPool&)>& hold) {
  std::array<int, 2> ready{};
  PLCHOST_TRY(check_errno(::pipe(ready.data()), "pipe"));
  Killed victim([&] {
    auto own = ObjectPool::attach(pool.name());
    (void)!::write(ready[1], own && hold(*own) ? "y" : "n", 1);
    for (;;) ::pause();
  });
  char held = 'n';
  (void)!::read(ready[0], &held, 1);
  ::close(ready[0]);
  ::close(ready[1]);
  if (held != 'y') return Samples();
  std::atomic<bool> killed{false};
  auto killer = Thread::start("killer", {}, [&] {
    victim.end();
    killed = true;
  });
  if (!killer) return std::unexpected(std::move(killer.error()));
  return wait_for(std::chrono::seconds(1), [&] { return pool.open_semaphore("0").has_value(); });
}

Result<std::vector<Row>> measure_all(const Plan& plan, ObjectPool& pool) {
  const std::uint32_t objects = kObjectsOfPlan * plan.objects;
  for (std::uint32_t i = 0; i < objects; ++i) {
    const auto made = pool.create_semaphore(std::to_string(i), 1, {.keep = true});
    if (!made) return std::unexpected(made.error());
  }
  PLCHOST_TRY_ASSIGN(const auto reader, ObjectPool::attach(pool.name(), ObjectPool::Access::read_only));
  std::vector<Row> rows;
  std::uint32_t at = 0;
  const auto next = [&at, objects] { return std::to_string((at += 7919) % objects); };
  {
    const Killed killer([&] { kill_many(pool.name(), objects); });
    PLCHOST_TRY_ASSIGN(auto opens,
                       wait_for(plan.each / 2, [&] { return pool.open_semaphore(next()).has_value(); }));
    rows.push_back(row_of(
        "pool_deaths/open", std::move(opens),
        fmt::format("open and close of one of {} objects, while others are killed in the midst of calls",
                    objects)));
    PLCHOST_TRY_ASSIGN(auto looks,
                       wait_for(plan.each / 2, [&] { return reader.look_at(next()).has_value(); }));
    rows.push_back(
        row_of("pool_deaths/look", std::move(looks), "a look at one, with the right to read only"));
  }
  const std::uint32_t memories = plan.objects / 5;
  auto many = wait_for_the_end_of(pool, [memories](ObjectPool& own) {
    static std::vector<SharedMemory> held;
    for (std::uint32_t i = 0; i < memories; ++i) {
      auto made = own.create_memory("held" + std::to_string(i), 4096);
      if (!made) return false;
      held.push_back(std::move(made->object));
    }
    return true;
  });
  if (!many) return std::unexpected(many.error());
  rows.push_back(
      row_of("pool_deaths/many_memories", *std::move(many),
             fmt::format("open and close, while one that held {} memories of 4 KiB is killed", memories)));
  auto large = wait_for_the_end_of(pool, [](ObjectPool& own) {
    static auto held = own.create_memory("large", kLarge);
    return held.has_value();
  });
  if (!large) return std::unexpected(large.error());
  rows.push_back(row_of("pool_deaths/4_GiB", *std::move(large), "the same, of one memory of 4 GiB"));
  return rows;
}

}  // namespace

Result<std::vector<Row>> measure_pool_deaths(const Plan& plan) {
  const std::string name = own_name("deaths");
  PLCHOST_TRY_ASSIGN(auto pool, ObjectPool::create(name, {.max_objects = 10 * plan.objects}));
  auto rows = measure_all(plan, pool);
  const PoolFindings found = pool.tidy();
  if (rows) rows->front().extra = {{"lists_made_anew", found.rebuilds}};
  ObjectPool::remove(name);
  remove_pool_memories(name);
  return rows;
}

}  // namespace plchost::bench
