#pragma once

#include <string>
#include <vector>

#include "tests/bench/samples.hpp"

namespace plchost::bench {

/// The rows as an SVG picture: for each latency, the share of samples above it; both axes logarithmic. The
/// floor of a row is dashed in its colour.
[[nodiscard]] std::string to_svg(const std::string& title, const std::vector<Row>& rows);

}  // namespace plchost::bench
