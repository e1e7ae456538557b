#pragma once

namespace plchost {

/// plchost-dds ends so when another host of the DDS domain has the name of this one. Any other end is none
/// that lasts: it is started again at once.
inline constexpr int kExitNameTaken = 3;

}  // namespace plchost
