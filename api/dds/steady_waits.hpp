#pragma once

namespace plchost::dds {

/// Makes the waits of Cyclone in this program independent of the clock on the wall, which can be set. Does
/// nothing when it is called: a program that calls it is linked with the functions that take the place of
/// Cyclone's.
void wait_by_steady_clock() noexcept;

}  // namespace plchost::dds
