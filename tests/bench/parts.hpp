#pragma once

#include <chrono>
#include <span>
#include <string_view>
#include <vector>

#include "shm/base/time.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/plot.hpp"
#include "tests/bench/row.hpp"

namespace plchost::bench {

inline constexpr Duration kCyclePeriod =
    std::chrono::milliseconds(1);  ///< of a task and of its floor, if the part says no other

/// One part of the benchmark: a file of its own with one function, and a line in the table of parts.cpp.
struct Part {
  std::string_view name;   ///< for --only, and of its picture
  std::string_view about;  ///< the measurement, and the floor beside it
  Drawing picture;         ///< the words of its picture; no title: none
  double turns;            ///< about how many times Plan::each it takes
  bool under_stress;       ///< measured a second time with --stress
  Result<std::vector<Row>> (*measure)(const Plan&);
};

[[nodiscard]] std::span<const Part> all_parts() noexcept;

[[nodiscard]] Result<std::vector<Row>> measure_cyclic(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_corun(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_cyclictest(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_fast(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_burst(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_post_process(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_post_dds(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_post_rate(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_post_many(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_cost(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_scale(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_poll(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_distributed_clock(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_pool(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_pool_deaths(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_blocks(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_variables(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_start(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_structured_text(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_fleet(const Plan& plan);

}  // namespace plchost::bench
