#pragma once

#include <cstddef>
#include <span>

namespace plchost::dds {

/// Whether a datagram may reach Cyclone's parser. 0.10.2 can be crashed by packets that nobody had to
/// authenticate. The gate refuses:
/// - submessages that do not fill the datagram exactly, whatever is in them;
/// - kinds of submessages that nobody needs here;
/// - samples whose fields are not where all vendors put them, or that have neither contents nor a key, where
///   Cyclone takes an offset from them unchecked;
/// - in the handshake's messages a key where contents must be (a null pointer in Cyclone);
/// - of a secured host: all that is in plain text and is not what is said before there are keys;
/// - of an unsecured host: samples of all builtin writers but those of discovery and liveliness, and these
///   in fragments (Cyclone copies what one fragment has into the memory that another one asked for).
/// What passes at an unsecured host has its parameters cut down to those that the host needs, in place: see
/// filter_parameters(). A message that is signed or encrypted as a whole is judged by its outer form only.
/// What passes in fragments of a handshake goes through HandshakeAssembly.
[[nodiscard]] bool admit(std::span<std::byte> datagram, bool secured) noexcept;

}  // namespace plchost::dds
