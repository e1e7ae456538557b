#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <span>

#include "api/dds/gate/submessage.hpp"

namespace plchost::dds {

inline constexpr std::size_t kChallenge = 32;

/// The sign of a sender in a message of a handshake.
struct HandshakeSign {
  std::span<const std::byte, kGuidPrefix> to;        ///< the participant that it is for
  std::span<const std::byte, kChallenge> challenge;  ///< the sender's own
  std::span<const std::byte> answered;               ///< the challenge that it answers; empty: none
};

enum class NoSign {
  another_class,  ///< Cyclone ignores the message
  incomplete      ///< it has not the challenges of its class
};

/// `contents`: of a sample of the handshake's writer, with their encapsulation.
[[nodiscard]] std::expected<HandshakeSign, NoSign> read_handshake_sign(
    std::span<const std::byte> contents) noexcept;

enum class SignUse {
  none,    ///< the message is taken out
  usual,   ///< it passes unless its sender is doubted
  awaited  ///< it passes
};

/// The knowledge of the participants that send, each by its GUID prefix.
struct HandshakeRecord {
  /// Takes a message of a handshake into account.
  SignUse (*take)(std::span<const std::byte> from, const HandshakeSign& sign);
  /// Whether plain messages of the participant are worth nothing now.
  bool (*is_doubted)(std::span<const std::byte> from);
};

/// Tells `record` the challenges in a datagram, which admit() and HandshakeAssembly have passed, and takes
/// out in place what participants that are doubted say in plain text. Returns the size that it has now; 0:
/// nothing is left to be said.
[[nodiscard]] std::size_t take_out_doubted(std::span<std::byte> datagram,
                                           const HandshakeRecord& record) noexcept;

}  // namespace plchost::dds
