#pragma once

#include <functional>
#include <vector>

#include "shm/base/result.hpp"
#include "tests/bench/row.hpp"

namespace plchost::bench {

/// Measures in a process of its own, for what cannot be started twice in one. system: that process has
/// failed.
[[nodiscard]] Result<std::vector<Row>> measure_apart(
    const std::function<Result<std::vector<Row>>()>& measure);

/// A row as text and back, without its series and without the members that the runner of the part fills.
void write_row(std::ostream& to, const Row& row);
[[nodiscard]] Row read_row(std::istream& from);

}  // namespace plchost::bench
