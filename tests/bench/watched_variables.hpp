#pragma once

#include <cstddef>

namespace plchost::bench {

/// Of the program whose variables are watched; fewer than one request may ask for.
inline constexpr std::size_t kWatchedVariables = 1000;

}  // namespace plchost::bench
