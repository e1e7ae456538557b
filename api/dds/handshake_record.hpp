#pragma once

#include "api/dds/gate/renewal_gate.hpp"
#include "api/dds/handshakes.h"

namespace plchost::dds {

static_assert(kGuidPrefix == PLC_GUID_PREFIX && kChallenge == PLC_CHALLENGE);

/// The knowledge that this process has of the participants that send, for take_out_doubted(). Any thread.
[[nodiscard]] inline HandshakeRecord own_record() noexcept {
  const auto take = [](std::span<const std::byte> from, const HandshakeSign& sign) {
    const auto octets = [](std::span<const std::byte> bytes) {
      return reinterpret_cast<const unsigned char*>(bytes.data());
    };
    const plc_HandshakeSign told{.from = octets(from),
                                 .to = octets(sign.to),
                                 .challenge = octets(sign.challenge),
                                 .answered = sign.answered.empty() ? nullptr : octets(sign.answered)};
    switch (plc_take_sign(&told)) {
      case PLC_SIGN_OF_NO_USE:
        return SignUse::none;
      case PLC_SIGN_AWAITED:
        return SignUse::awaited;
      case PLC_SIGN_OF_USE:
        break;
    }
    return SignUse::usual;
  };
  const auto is_doubted = [](std::span<const std::byte> from) {
    return plc_is_doubted(reinterpret_cast<const unsigned char*>(from.data()));
  };
  return {.take = take, .is_doubted = is_doubted};
}

}  // namespace plchost::dds
