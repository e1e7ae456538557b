#pragma once

#include <array>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "schedulers/policies/registry.hpp"
#include "schedulers/task_set.hpp"
#include "tests/support/manual_clock.hpp"

namespace plchost {

/// The names of all schedulers in the registry: each of them keeps the promises tested here.
inline std::vector<std::string_view> every_scheduler() {
  std::vector<std::string_view> names;
  for (const SchedulerEntry& entry : all_schedulers()) names.push_back(entry.name);
  return names;
}

inline std::string scheduler_test_name(const testing::TestParamInfo<std::string_view>& tested) {
  return std::string(tested.param);
}

/// Whether threads may have the priorities of an instance here.
inline bool may_use_fifo() {
  return Thread::start("probe", {.fifo = 1, .nice = 0}, [] {}).has_value();
}

/// A set of tasks on a clock `Time`, with their statistics and the external events that they name.
template <class Time>
class Tasks {
 public:
  /// A task that is still to be filled in; add() takes it.
  static TaskConfig cyclic(std::string name, Duration interval, std::function<void()> entry) {
    TaskConfig config;
    config.name = std::move(name);
    config.interval = interval;
    config.entry = std::move(entry);
    return config;
  }
  static TaskConfig external(std::string name, std::string event, std::function<void()> entry) {
    TaskConfig config;
    config.name = std::move(name);
    config.kind = TaskKind::external;
    config.external_event = std::move(event);
    config.entry = std::move(entry);
    return config;
  }
  static TaskConfig event(std::string name, std::function<bool()> variable, std::function<void()> entry) {
    TaskConfig config;
    config.name = std::move(name);
    config.kind = TaskKind::event;
    config.event_variable = std::move(variable);
    config.entry = std::move(entry);
    return config;
  }
  static TaskConfig freewheeling(std::string name, std::function<void()> entry) {
    TaskConfig config;
    config.name = std::move(name);
    config.kind = TaskKind::freewheeling;
    config.entry = std::move(entry);
    return config;
  }

  void add(TaskConfig config) { configs_.push_back(std::move(config)); }

  Result<void> create() {
    PLCHOST_TRY_ASSIGN(set, TaskSet::create(clock, PriorityBand::normal, std::move(configs_), environment()));
    return {};
  }

  /// The event of that name, made when it is first asked for, by a task or by a poster.
  CountedEvent& event_named(std::string_view name) {
    for (auto& [known, event] : events_) {
      if (known == name) return event;
    }
    return events_.emplace_back(std::piecewise_construct, std::tuple(name), std::tuple()).second;
  }

  [[nodiscard]] TaskCounters counters(std::size_t task) const {
    // Their writer may get no core for a while in the midst of it.
    for (;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
      if (const auto counters = statistics_[task].counters.read(1000)) return *counters;
    }
  }

  /// Waits for cycles that no clock tells of. The number is exact if nothing more is to come.
  void wait_for_cycles(std::size_t task, std::uint64_t cycles) const {
    while (counters(task).cycles < cycles) std::this_thread::sleep_for(std::chrono::microseconds(50));
  }

  Time clock;
  bool unprivileged = true;
  DeviceFiles* devices = &linux_device_files();
  std::function<void(std::size_t)> to_park;

 private:
  TaskEnvironment environment() {
    TaskEnvironment environment;
    environment.find_event = [this](std::string_view name) -> Result<CountedEvent*> {
      return &event_named(name);
    };
    environment.statistics = [this](std::size_t index) -> TaskStatistics& {
      while (statistics_.size() <= index) statistics_.emplace_back();
      return statistics_[index];
    };
    environment.flight = [this](std::size_t index) {
      while (flights_.size() <= index) flights_.emplace_back();
      return FlightRing(flights_[index].written, flights_[index].words);
    };
    environment.to_park = to_park;
    environment.allow_unprivileged = unprivileged;
    environment.devices = devices;
    return environment;
  }

  std::vector<TaskConfig> configs_;
  std::deque<TaskStatistics> statistics_;
  struct Flight {
    FlightRing::Word written{0};
    std::array<FlightRing::Word, 128 * FlightRing::kWordsOfEntry> words{};
  };
  std::deque<Flight> flights_;
  std::deque<std::pair<std::string, CountedEvent>> events_;

 public:
  std::unique_ptr<TaskSet> set;  // last: it uses all of the above
};

/// Tasks on a clock that the test moves.
class ManualTasks : public Tasks<ManualClock> {
 public:
  ManualTasks() = default;
  ManualTasks(const ManualTasks&) = delete;
  ManualTasks& operator=(const ManualTasks&) = delete;
  ~ManualTasks() { finish(); }

  /// Ends the tasks, before anything goes that their code uses. Every cycle that is under way comes to its
  /// end, as long as somebody moves the clock.
  void finish() {
    if (set && set->running()) (void)set->stop(Duration::zero());
    clock.run_for(std::chrono::seconds(100));
    set.reset();
  }

  /// Starts them; the origin of their grids.
  TimePoint start(std::string_view scheduler, const SchedulerSettings& settings = {}) {
    const auto started = set->start(scheduler, settings);
    EXPECT_TRUE(started) << started.error().describe();
    return clock.now() + TaskSet::kStartLead;
  }
};

/// When the cycles of one task began. Read only while all threads sleep.
using Starts = std::vector<TimePoint>;

/// `count` points of a grid.
inline Starts grid(TimePoint origin, Duration interval, int count) {
  Starts points;
  for (int i = 0; i < count; ++i) points.push_back(origin + i * interval);
  return points;
}

}  // namespace plchost
