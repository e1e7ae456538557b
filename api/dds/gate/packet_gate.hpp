#pragma once

#include <cstddef>
#include <span>

namespace plchost::dds {

/// Whether a datagram may reach Cyclone's parser. 0.10.2 can be crashed by packets that nobody had to
/// authenticate; this knows the ways that were found by floods of mutated packets:
/// - submessages that do not fill the datagram exactly are refused, whatever is in them;
/// - in the handshake's messages a key stands where contents must be (a null pointer in Cyclone);
/// - samples of the two writers that speak before there are keys, whose fields are not where they must be or
///   that neither have contents nor are a key (Cyclone takes an offset from them unchecked);
/// - of a secured host: all that is in plain text and is not what is said before there are keys. It would be
///   refused later, by more code.
/// A message that is signed or encrypted as a whole is judged by its outer form only. What passes in
/// fragments goes through HandshakeAssembly.
[[nodiscard]] bool is_acceptable(std::span<const std::byte> datagram, bool secured) noexcept;

}  // namespace plchost::dds
