#pragma once

namespace plchost::dds {

/// Makes Cyclone in this program keep the keys of a reader or writer that is not known yet once only, however
/// often they come. Does nothing when it is called: a program that calls it is linked with the function that
/// takes the place of Cyclone's.
void keep_tokens_once() noexcept;

}  // namespace plchost::dds
