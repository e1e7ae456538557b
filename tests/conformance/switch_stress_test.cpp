#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string_view>
#include <utility>

#include "tests/conformance/scheduler_fixture.hpp"

// A hundred exchanges of the scheduler per second, between any two, under load, with real threads and real
// time. A few seconds by default; PLCHOST_SWITCH_SECONDS=60 for the full minute.

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

seconds duration() {
  const char* const given = std::getenv("PLCHOST_SWITCH_SECONDS");
  return seconds(given != nullptr ? std::atoi(given) : 4);
}

// Followed from cycle to cycle, on the task's own thread.
struct GridWatch {
  Duration interval;
  std::int64_t release = 0;
  std::uint64_t lost = 0;
  std::atomic<std::uint64_t> off_grid{0};
  std::atomic<std::uint64_t> not_accounted{0};
  std::atomic<std::uint64_t> twice{0};

  void after_cycle(const TaskCounters& now) noexcept {
    if (release != 0) {
      const std::int64_t step = now.release_ns - release;
      if (step <= 0) ++twice;
      if (step % interval.count() != 0) ++off_grid;
      if (step / interval.count() != 1 + static_cast<std::int64_t>(now.lost_cycles - lost)) ++not_accounted;
    }
    release = now.release_ns;
    lost = now.lost_cycles;
  }
};

class SwitchUnderLoad : public testing::Test, public Tasks<LinuxClock> {
 protected:
  ~SwitchUnderLoad() override {
    done_ = true;
    for (std::thread& thread : load_) thread.join();
  }

  void SetUp() override {
    // Like an instance where that is allowed; elsewhere all threads compete with the load.
    unprivileged = !may_use_fifo();
    for (int i = 0; i < 2; ++i) {
      load_.emplace_back([this] {
        while (!done_) std::atomic_signal_fence(std::memory_order_seq_cst);
      });
    }
  }

  void add_watched(GridWatch& watch, LatePolicy late, Duration execution) {
    TaskConfig task = cyclic("cyclic" + std::to_string(watch.interval.count()), watch.interval,
                             [this, execution] { clock.spin_until(clock.now() + execution); });
    task.late = late;
    task.iec_priority = 5;
    task.after_cycle = [&watch](const TaskCounters& now) { watch.after_cycle(now); };
    add(task);
  }

  // Until the time is over: how often from which to which, and how many cycles of the first task each of them
  // has run.
  struct Switches {
    std::map<std::pair<std::string_view, std::string_view>, int> exchanges;
    std::map<std::string_view, std::uint64_t> cycles;
  };
  Switches switch_about(const SchedulerSettings& settings) {
    std::mt19937 random(5);
    const auto schedulers = all_schedulers();
    const TimePoint begin = clock.now();
    Duration longest{};
    Duration sum{};
    Switches seen;
    std::uint64_t cycles = counters(0).cycles;
    int switches = 0;
    for (TimePoint next = begin; next < begin + duration(); next += milliseconds(10), ++switches) {
      std::this_thread::sleep_for(std::max(next - clock.now(), Duration::zero()));
      const std::size_t to = std::uniform_int_distribution<std::size_t>(0, schedulers.size() - 1)(random);
      const std::string_view from = set->scheduler_name();
      seen.cycles[from] += counters(0).cycles - std::exchange(cycles, counters(0).cycles);
      ++seen.exchanges[{from, schedulers[to].name}];
      const TimePoint before = clock.now();
      EXPECT_TRUE(set->switch_to(schedulers[to].name, settings));
      EXPECT_EQ(set->scheduler_name(), schedulers[to].name);
      const Duration took = clock.now() - before;
      longest = std::max(longest, took);
      sum += took;
    }
    const double elapsed = std::chrono::duration<double>(clock.now() - begin).count();
    std::printf("%d switches in %.1f s; one took %.2f ms, the longest %.2f ms\n", switches, elapsed,
                std::chrono::duration<double, std::milli>(sum).count() / switches,
                std::chrono::duration<double, std::milli>(longest).count());
    return seen;
  }

  std::atomic<bool> done_{false};
  std::vector<std::thread> load_;
};

TEST_F(SwitchUnderLoad, KeepsEveryGridLosesNoEventAndRunsNoneTwice) {
  constexpr std::size_t kPosted = 3;
  constexpr std::size_t kRaised = 4;
  constexpr std::size_t kEdge = 5;
  std::array<GridWatch, 3> watches{};
  watches[0].interval = milliseconds(1);
  watches[1].interval = microseconds(1700);
  watches[2].interval = milliseconds(20);
  add_watched(watches[0], LatePolicy::next, microseconds(50));
  add_watched(watches[1], LatePolicy::asap, microseconds(100));
  add_watched(watches[2], LatePolicy::next, milliseconds(2));
  std::atomic<bool> variable{false};
  std::atomic<std::uint64_t> looks{0};
  add(external("posted", "ready", [] {}));
  add(event("raised", [] { return false; }, [] {}));
  add(event(
      "edge",
      [&] {
        ++looks;
        return variable.load();
      },
      [] {}));
  add(freewheeling("loop", [] {}));
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.scheduler_interval = microseconds(500);
  ASSERT_TRUE(set->start("CmpSchedule", settings));

  std::atomic<bool> ending{false};
  std::uint64_t posts = 0;
  std::thread poster([&] {
    for (; !ending; ++posts) {
      event_named("ready").post();
      set->task(kRaised).raise_event();
      std::this_thread::sleep_for(microseconds(200));
    }
  });
  // An edge, and down again, each held until it was seen.
  std::uint64_t edges = 0;
  std::thread toggler([&] {
    const auto wait_for_looks = [&] {
      for (const std::uint64_t before = looks; looks < before + 2;)
        std::this_thread::sleep_for(microseconds(300));
    };
    while (!ending) {
      variable = true;
      ++edges;
      wait_for_looks();
      wait_for_cycles(kEdge, edges);
      variable = false;
      wait_for_looks();
    }
  });
  const Switches switches = switch_about(settings);
  ending = true;
  poster.join();
  toggler.join();
  wait_for_cycles(kPosted, posts);
  wait_for_cycles(kRaised, posts);
  std::this_thread::sleep_for(milliseconds(20));
  ASSERT_TRUE(set->stop(seconds(30)));
  done_ = true;

  for (const SchedulerEntry& from : all_schedulers()) {
    for (const SchedulerEntry& to : all_schedulers()) {
      EXPECT_TRUE((switches.exchanges.contains({from.name, to.name}))) << from.name << " to " << to.name;
    }
    // A hundred stretches of 10 ms and more: a scheduler that releases nothing has none.
    EXPECT_GE((switches.cycles.contains(from.name) ? switches.cycles.at(from.name) : 0U), 50U) << from.name;
  }
  EXPECT_EQ(counters(kPosted).cycles, posts);
  EXPECT_EQ(counters(kPosted).lost_events, 0U);
  EXPECT_EQ(counters(kRaised).cycles, posts);
  EXPECT_EQ(counters(kRaised).lost_events, 0U);
  EXPECT_EQ(counters(kEdge).cycles, edges);
  EXPECT_EQ(counters(kEdge).lost_events, 0U);
  for (std::size_t i = 0; i < watches.size(); ++i) {
    EXPECT_EQ(watches[i].off_grid, 0U) << i;
    EXPECT_EQ(watches[i].not_accounted, 0U) << i;
    EXPECT_EQ(watches[i].twice, 0U) << i;
    std::printf("cyclic %.1f ms: %llu cycles, %llu lost\n",
                std::chrono::duration<double, std::milli>(watches[i].interval).count(),
                static_cast<unsigned long long>(counters(i).cycles),
                static_cast<unsigned long long>(counters(i).lost_cycles));
  }
  std::printf("%llu posts, %llu raised, %llu edges: none lost, none run twice\n",
              static_cast<unsigned long long>(counters(kPosted).cycles),
              static_cast<unsigned long long>(counters(kRaised).cycles),
              static_cast<unsigned long long>(counters(kEdge).cycles));
}

}  // namespace
}  // namespace plchost
