#pragma once

#include <string>
#include <vector>

#include "shm/base/time.hpp"
#include "shm/pages/flight_page.hpp"

namespace plchost {

inline constexpr std::size_t kMostActivity = 128;  ///< lines

/// The entries of a flight recorder until that time, in words, the oldest first: "-1.204 ms Fill: start, 3.1
/// us after its release", with the time from there. Of each thread the last ones, so that slow tasks have
/// some, too. Soft threads; allocates.
[[nodiscard]] std::vector<std::string> activity_before(const FlightPage& page, TimePoint until);
[[nodiscard]] std::vector<std::string> activity_before(const FlightPageReader& page, TimePoint until);

}  // namespace plchost
