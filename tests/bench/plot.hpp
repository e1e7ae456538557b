#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/row.hpp"

namespace plchost::bench {

/// The words of a picture. Each fits into its place in every usual font (`tests/gates/pictures.py`).
struct Drawing {
  std::string_view title = {};  ///< empty: the part has no picture
  std::string_view x = {};      ///< the name of the axis below, with its unit
  std::string_view y = {};
  std::string_view floor = {};                 ///< the floor's meaning
  std::array<std::string_view, 2> notes = {};  ///< below the legend: the explanation
};

/// The rows as an SVG picture: for each latency, the share of samples above it; both axes logarithmic. The
/// floor is dashed: grey if the rows share one, else in the colour of its row. Rows that have series are
/// drawn as these: magnitude, logarithmic, over time, one panel for each name of a panel. Each curve has
/// marks of its own shape, so that it is known without its colour. `condition` goes behind the title.
[[nodiscard]] std::string to_svg(const Drawing& drawing, std::string_view condition,
                                 const std::vector<Row>& rows);

}  // namespace plchost::bench
