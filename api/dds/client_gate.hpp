#pragma once

#include <cstddef>

namespace plchost::dds {

/// The gate of a secured client, as plc_filter_datagrams() asks for it: admit(), HandshakeAssembly,
/// take_out_doubted().
/// Without it Cyclone believes any packet in plain text that a host has ended, because it never checks the
/// writer of secured announcements. The client would drop its host.
extern "C" std::size_t pass_to_client(unsigned char* buffer, std::size_t size, std::size_t capacity);

}  // namespace plchost::dds
