#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "api/client/control_client.hpp"
#include "shm/pages/instance_page.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/child.hpp"
#include "tests/bench/dds_poster.hpp"
#include "tests/bench/samples.hpp"

namespace plchost::bench {

inline constexpr Duration kCellPatience = std::chrono::seconds(20);

template <class Condition>
[[nodiscard]] Result<void> wait_until(Condition condition, const std::string& what) {
  const TimePoint end = MonotonicClock::now() + kCellPatience;
  while (!condition()) {
    if (MonotonicClock::now() > end) return failure(ErrorCode::timed_out, what + " did not happen");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return {};
}

/// Calls for a slice, and notes how long each call took.
template <class Call>
void time_calls(Duration slice, Samples& into, Call call) {
  const TimePoint end = MonotonicClock::now() + slice;
  while (MonotonicClock::now() < end) {
    const TimePoint start = MonotonicClock::now();
    call();
    into.push(MonotonicClock::now() - start);
  }
}

/// The event of the cell.
[[nodiscard]] inline HostEvent ping_event() {
  return {kBenchHost, "probe", "ping"};
}

/// plchostd with one instance that runs the probe, "probe", whose external event is "ping".
class Cell {
 public:
  Cell(const Plan& plan, const DdsDomains& domains, const std::string& name)
      : pool_(name), folder_(std::filesystem::temp_directory_path() / name) {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "bench.toml") << fmt::format(
        "[host]\nname = \"{}\"\ndds_domain = {}\nrun_directory = \"{}\"\nstate_directory = \"{}\"\npool = "
        "\"{}\"\ncores = [{}]\n"
        "housekeeping_cores = [{}]\nlog_level = \"error\"\n"
        "[[instance]]\nname = \"probe\"\ncore = {}\nscheduler = \"CmpSchedule\"\napplication = \"{}\"\n",
        kBenchHost, domains.plchost, (folder_ / "run").string(), (folder_ / "state").string(), pool_,
        plan.task_core, plan.poster_core, plan.task_core,
        (plan.programs.parent_path() / "applications" / "bench_probe.so").string());
  }
  Cell(const Cell&) = delete;
  Cell& operator=(const Cell&) = delete;
  ~Cell() {
    manager_.end();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  [[nodiscard]] const std::string& pool() const { return pool_; }

  [[nodiscard]] Result<void> start(const Plan& plan) {
    const std::string program = (plan.programs / "plchostd").string();
    const std::string config = (folder_ / "bench.toml").string();
    PLCHOST_TRY_ASSIGN(manager_, Child::start({program, "--config", config}));
    return wait_until(
        [&] {
          const auto page = InstancePageReader::open(pool_, "probe");
          if (!page) return false;
          const auto runtime = page->runtime();
          return runtime && runtime->running == 1;
        },
        "the start of the measured instance");
  }

 private:
  std::string pool_;
  std::filesystem::path folder_;
  Child manager_;
};

}  // namespace plchost::bench
