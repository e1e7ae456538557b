#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tests/bench/samples.hpp"

namespace plchost::bench {

/// One threshold that a row is held against: `measured` must be below `bound` (or equal to it, if
/// `or_equal`).
struct Target {
  std::string text;  ///< as the benchmark's documentation says it, "median below F + 2 us"
  double measured = 0;
  double bound = 0;
  bool or_equal = false;
  [[nodiscard]] bool met() const noexcept {
    return or_equal ? measured <= bound : measured < bound;  // neither, if one of them is not a number
  }
};

/// A curve over time, for a picture: seconds since the start, nanoseconds.
struct Series {
  std::string name;
  std::string panel;  ///< of the picture: series with one name of a panel share it
  std::vector<std::pair<double, double>> points;
};

/// What was measured, beside the floor that was measured in the same run.
struct Row {
  std::string name;                ///< "cyclic/CmpScheduleTimer/1ms": part, who, what
  std::string condition = "idle";  ///< or "stress"; filled by whoever runs the part
  Samples ours = {};               ///< what it is stands in the README: mostly release to first instruction
  Samples floor = {};
  std::vector<std::pair<std::string, double>> extra =
      {};  ///< "lost_cycles": further figures, in JSON as they are
  std::vector<Target> targets = {};
  std::vector<Series> series = {};
  std::string note = {};  ///< what a reader must know about these figures
};

/// Where it was measured and the rows, as JSON; times in microseconds unless a key says otherwise.
[[nodiscard]] std::string to_json(const std::vector<Row>& rows);
/// The rows as two tables in Markdown: the figures, and what was to be shown with its verdict.
[[nodiscard]] std::string to_markdown(const std::vector<Row>& rows);
/// The rows as a table for people, and below it the further figures and what is met.
[[nodiscard]] std::string to_table(const std::vector<Row>& rows);

}  // namespace plchost::bench
