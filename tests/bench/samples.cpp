#include "tests/bench/samples.hpp"

#include <algorithm>

namespace plchost::bench {

Summary summarise(const Samples& samples) {
  std::vector<Duration> sorted = samples.values();
  if (sorted.empty()) return {};
  const Duration greatest = std::max(std::ranges::max(sorted), samples.greatest_dropped());
  std::ranges::sort(sorted);
  const auto at = [&](double fraction) {
    const double above = static_cast<double>(sorted.size()) * (1 - fraction);
    if (fraction > 0.5 && above < 0.9995) return kNotMeasured;  // a little less: 0.999 is rounded
    const auto index = static_cast<std::size_t>(fraction * static_cast<double>(sorted.size()));
    return to_us(sorted[std::min(index, sorted.size() - 1)]);
  };
  return {.p50 = at(0.5), .p90 = at(0.9), .p99 = at(0.99), .p999 = at(0.999), .max = to_us(greatest)};
}

double decisive_p999(const Samples& samples) {
  constexpr std::size_t kLeast = 19'500;
  return samples.size() >= kLeast ? summarise(samples).p999 : kNotMeasured;
}

}  // namespace plchost::bench
