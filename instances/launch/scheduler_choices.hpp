#pragma once

#include <string_view>
#include <vector>

namespace plchost {

/// The names that LaunchOptions::scheduler may have, from the registry of schedulers: a check of a
/// configuration needs them without knowing the schedulers.
[[nodiscard]] std::vector<std::string_view> scheduler_choices();

}  // namespace plchost
