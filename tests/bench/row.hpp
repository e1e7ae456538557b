#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/bench/samples.hpp"

namespace plchost::bench {

/// One threshold that a row is held against: `measured` must be below `bound` (or equal to it, if
/// `or_equal`).
struct Target {
  std::string text;  ///< as the benchmark's documentation says it, "median below F + 2 us"
  std::string unit;  ///< of `measured` and `bound`
  double measured = 0;
  double bound = 0;
  bool or_equal = false;
  /// Decided only if the rounds' figures lie no further apart than the bound: else the machine is measured.
  bool only_steady = false;
  /// False if one of them is kNotMeasured.
  [[nodiscard]] bool decided() const noexcept { return !std::isnan(measured) && !std::isnan(bound); }
  [[nodiscard]] bool met() const noexcept {
    return or_equal ? measured <= bound : measured < bound;  // neither, if one of them is not a number
  }
};

/// Lost cycles in a million: at most twice those of `floor`, and 100.
/// Not decided in a round whose floor loses more than 1,000. A bound that follows the machine's noise would
/// admit everything.
/// @param floor_text names the floor, "F at the same period"
[[nodiscard]] Target lost_cycles_target(std::string_view floor_text, double lost, double floor);

/// A curve over time, for a picture: seconds since the start, nanoseconds.
struct Series {
  std::string name;
  std::string panel;  ///< of the picture: series with one name of a panel share it
  std::vector<std::pair<double, double>> points;
};

/// Further figures by name. The end of a name is its unit: _us, _ms, _ns, _gb_s, _mib, _per_second,
/// _per_million, _per_cycle, _percent, _ppb; "share" and "load" are of a core. All others are counts.
using Extra = std::vector<std::pair<std::string, double>>;

/// The results of one round, of a row that was measured in several.
struct Round {
  Summary ours;
  Summary floor;
  Extra extra;
  std::vector<Target> targets;
};

/// A measurement, beside the floor that was measured in the same run.
struct Row {
  std::string name;                ///< "cyclic/CmpScheduleTimer/1ms": part, who, what
  std::string sample = "";         ///< the meaning of one sample: "a cycle"
  std::string condition = "idle";  ///< or "stress"; filled by the runner of the part
  Samples ours = {};               ///< its meaning stands in the README: mostly release to first instruction
  Samples floor = {};              ///< empty: there is none
  Extra extra = {};
  std::vector<Target> targets = {};
  std::vector<Series> series = {};
  std::string note = {};           ///< a remark that the reader of these figures needs
  std::vector<Round> rounds = {};  ///< filled by add_round
  Extra conditions = {};           ///< of the machine, in each round; filled by the runner of the part
};

/// Adds what a further round gave to `all`: to the row of the same name and condition, or as a new row. A row
/// has the samples of all rounds, the median of each further figure, and the curves of the first round.
void add_round(std::vector<Row>& all, std::vector<Row> round);

/// In so many of its rounds the row's target `index` was met, and could be decided.
struct Verdict {
  std::size_t met = 0;
  std::size_t decided = 0;
  /// "met", "not met", "met in 2 of 3 rounds", "not measured"
  [[nodiscard]] std::string text() const;
};
[[nodiscard]] Verdict verdict_of(const Row& row, std::size_t index);

/// An array with an object for each row; times in microseconds unless a key says otherwise. A missing
/// measurement, and a comparison with it, is null.
[[nodiscard]] std::string to_json(const std::vector<Row>& rows);
/// The rows as a table for people, and below it the further figures and what is met.
[[nodiscard]] std::string to_table(const std::vector<Row>& rows);

}  // namespace plchost::bench
