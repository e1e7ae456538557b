#include "tests/bench/samples.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace plchost::bench {

namespace {

struct Summary {
  double p50 = 0;
  double p99 = 0;
  double p999 = 0;
  double max = 0;
};

double to_us(Duration value) {
  return static_cast<double>(value.count()) / 1e3;
}

Summary summarise(const Samples& samples) {
  std::vector<Duration> sorted = samples.values();
  if (sorted.empty()) return {};
  std::ranges::sort(sorted);
  const auto at = [&](double fraction) {
    const auto index = static_cast<std::size_t>(fraction * static_cast<double>(sorted.size()));
    return to_us(sorted[std::min(index, sorted.size() - 1)]);
  };
  return {.p50 = at(0.5), .p99 = at(0.99), .p999 = at(0.999), .max = to_us(sorted.back())};
}

double ratio(double ours, double floor) {
  return floor > 0 ? ours / floor : 0;
}

}  // namespace

std::string to_json(const std::vector<Row>& rows) {
  nlohmann::ordered_json array = nlohmann::ordered_json::array();
  for (const Row& row : rows) {
    const Summary ours = summarise(row.ours);
    const Summary floor = summarise(row.floor);
    array.push_back({{"name", row.name},
                     {"p50_us", ours.p50},
                     {"p99_us", ours.p99},
                     {"p999_us", ours.p999},
                     {"max_us", ours.max},
                     {"floor_p50_us", floor.p50},
                     {"floor_p99_us", floor.p99},
                     {"floor_p999_us", floor.p999},
                     {"floor_max_us", floor.max},
                     {"ratio_p50", ratio(ours.p50, floor.p50)},
                     {"ratio_p99", ratio(ours.p99, floor.p99)},
                     {"samples", row.ours.size()}});
  }
  return array.dump(2) + "\n";
}

std::string to_table(const std::vector<Row>& rows) {
  std::string text =
      fmt::format("{:<28} {:>9} {:>9} {:>9} {:>10} {:>10} {:>7} {:>7} {:>8}\n", "name", "p50 us", "p99 us",
                  "p99.9 us", "floor p50", "floor p99", "x p50", "x p99", "samples");
  for (const Row& row : rows) {
    const Summary ours = summarise(row.ours);
    const Summary floor = summarise(row.floor);
    text += fmt::format("{:<28} {:>9.2f} {:>9.2f} {:>9.2f} {:>10.2f} {:>10.2f} {:>7.2f} {:>7.2f} {:>8}\n",
                        row.name, ours.p50, ours.p99, ours.p999, floor.p50, floor.p99,
                        ratio(ours.p50, floor.p50), ratio(ours.p99, floor.p99), row.ours.size());
  }
  return text;
}

}  // namespace plchost::bench
