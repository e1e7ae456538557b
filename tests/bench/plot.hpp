#pragma once

#include <string>
#include <vector>

#include "tests/bench/row.hpp"

namespace plchost::bench {

/// The rows as an SVG picture: for each latency, the share of samples above it; both axes logarithmic. The
/// floor is dashed: grey if the rows share one, else in the colour of its row. Rows that have series are
/// drawn as these: magnitude, logarithmic, over time.
[[nodiscard]] std::string to_svg(const std::string& title, const std::vector<Row>& rows);

}  // namespace plchost::bench
