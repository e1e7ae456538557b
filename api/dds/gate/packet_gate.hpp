#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace plchost::dds {

/// The part of a datagram that Cyclone gets.
enum class Admission : std::uint8_t {
  refused,  ///< nothing
  cut,      ///< all but submessages that are not admitted: these are padding now
  whole,    ///< all; plain-text samples of clients, which are ignored, are gaps now
};

/// Decides what of a datagram may reach Cyclone's parser. 0.10.2 can be crashed by packets that nobody had to
/// authenticate. The gate refuses a datagram:
/// - with submessages that do not fill it exactly, whatever is in them;
/// - that does not say which participant a part of it is of;
/// - of which nothing would be left.
/// Of all others it takes out single submessages, in place:
/// - kinds of submessages that nobody needs here;
/// - samples whose fields are not where all vendors put them, or that have neither contents nor a key, where
///   Cyclone takes an offset from them unchecked;
/// - in the handshake's messages a key where contents must be (a null pointer in Cyclone);
/// - of a secured host: all that is in plain text, but for the messages before there are keys. Samples of the
///   writers of discovery and liveliness are replaced by a gap, because Cyclone sends some of them in plain
///   text;
/// - of an unsecured host: samples of all builtin writers but those of discovery and liveliness, and these
///   in fragments. Cyclone copies what one fragment has into the memory that another one asked for.
/// At an unsecured host the parameters of a datagram that passes are cut down to those that the host needs,
/// in place: see filter_parameters(). A message that is signed or encrypted as a whole is judged by its outer
/// form only. Fragments of a handshake that pass go through HandshakeAssembly.
[[nodiscard]] Admission admit(std::span<std::byte> datagram, bool secured) noexcept;

}  // namespace plchost::dds
