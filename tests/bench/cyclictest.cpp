// cyclictest of rt-tests beside F, as an independent reader of the same floor: same period, priority and
// core, in alternation. It holds /dev/cpu_dma_latency by itself.

#include <charconv>
#include <sstream>

#include <fmt/format.h>

#include "tests/bench/child.hpp"
#include "tests/bench/cyclic_loop.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

constexpr int kMaxUs = 100000;

/// Lines "000012 000345": so many cycles with that latency in us, rounded down. Those above kMaxUs are only
/// counted, in the line "# Histogram Overflows: 00003".
void add_histogram(const std::string& text, Samples& into) {
  constexpr std::string_view kOverflows = "# Histogram Overflows: ";
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    Duration::rep us = 0;
    std::uint64_t count = 0;
    if (line.starts_with(kOverflows)) {
      us = kMaxUs;
      count = std::stoull(line.substr(kOverflows.size()));
    } else {
      const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), us);
      if (error != std::errc() || *end != ' ') continue;
      count = std::stoull(end);
    }
    for (std::uint64_t i = 0; i < count; ++i) into.push(std::chrono::microseconds(us));
  }
}

Result<void> run_cyclictest(const Plan& plan, Duration slice, Samples& into) {
  // By the number of cycles: its duration goes by whole seconds.
  const auto text = output_of({"cyclictest", "-q", "-m", "-t", "1", "-p", std::to_string(kPriority.fifo),
                               "-i", std::to_string(kCyclePeriod / std::chrono::microseconds(1)), "-a",
                               std::to_string(plan.task_core), "-l", std::to_string(slice / kCyclePeriod),
                               "-h", std::to_string(kMaxUs)});
  if (!text) return std::unexpected(text.error());
  add_histogram(*text, into);
  return {};
}

}  // namespace

Result<std::vector<Row>> measure_cyclictest(const Plan& plan) {
  Row row{.name = "cyclictest/1ms", .sample = "a cycle"};
  if (!is_installed("cyclictest")) {
    row.note = "skipped: cyclictest (Debian: rt-tests) is not installed";
    return std::vector{row};
  }
  BareLoop bare(Wait::sleep, kCyclePeriod);
  CyclicFigures floor;
  auto done = alternate(plan, {slices_of(plan, bare, kCyclePeriod, floor),
                               [&](Duration slice) { return run_cyclictest(plan, slice, row.ours); }});
  if (!done) return std::unexpected(std::move(done.error()));
  row.floor = floor.latencies;
  row.note = "no part of plchost: shows that F is what cyclictest calls latency (it counts whole us)";
  return std::vector{row};
}

}  // namespace plchost::bench
