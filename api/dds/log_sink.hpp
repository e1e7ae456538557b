#pragma once

namespace plchost::dds {

/// Sends what Cyclone DDS has to say (errors and warnings) to the process's log, at most kMaxDdsLogLines a
/// second. Junk on the network would otherwise write tens of thousands of lines. Before the domain is made.
void install_log_sink();

inline constexpr unsigned kMaxDdsLogLines = 10;

}  // namespace plchost::dds
