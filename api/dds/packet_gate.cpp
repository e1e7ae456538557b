#include "api/dds/packet_gate.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace plchost::dds {

namespace {

// RTPS 2.5, chapter 9.4; DDS Security 1.1, chapter 7.3.
constexpr std::size_t kHeader = 20;
constexpr std::size_t kSubmessageHeader = 4;
constexpr std::uint8_t kPad = 0x01;
constexpr std::uint8_t kInfoTimestamp = 0x09;
constexpr std::uint8_t kData = 0x15;
constexpr std::uint8_t kDataFragment = 0x16;
constexpr std::uint8_t kSecuredMessagePrefix = 0x33;
constexpr std::uint8_t kLittleEndian = 0x01;
constexpr std::uint8_t kDataHasContents = 0x04;
constexpr std::uint8_t kDataIsKey = 0x08;
constexpr std::uint8_t kFragmentIsOfKey = 0x04;
/// Behind the header of a submessage: extra flags, octets to inline QoS, the reader's entity.
constexpr std::size_t kWriterEntity = kSubmessageHeader + 8;

using Entity = std::array<std::uint8_t, 4>;
constexpr Entity kParticipantWriter{0x00, 0x01, 0x00, 0xc2};
constexpr Entity kHandshakeWriter{0x00, 0x02, 0x01, 0xc3};

std::uint8_t byte_at(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return std::to_integer<std::uint8_t>(bytes[at]);
}

bool is_acceptable_sample(std::span<const std::byte> submessage, bool secured) noexcept {
  if (submessage.size() < kWriterEntity + sizeof(Entity)) return false;
  Entity writer{};
  for (std::size_t i = 0; i < writer.size(); ++i) writer[i] = byte_at(submessage, kWriterEntity + i);
  const std::uint8_t flags = byte_at(submessage, 1);
  if (writer == kHandshakeWriter) {
    return byte_at(submessage, 0) == kData ? (flags & (kDataHasContents | kDataIsKey)) == kDataHasContents
                                           : (flags & kFragmentIsOfKey) == 0;
  }
  return !secured || writer == kParticipantWriter;
}

}  // namespace

bool is_acceptable(std::span<const std::byte> datagram, bool secured) noexcept {
  constexpr std::array<std::uint8_t, 5> kRtps2{'R', 'T', 'P', 'S', 2};
  if (datagram.size() < kHeader) return false;
  for (std::size_t i = 0; i < kRtps2.size(); ++i) {
    if (byte_at(datagram, i) != kRtps2[i]) return false;
  }
  auto rest = datagram.subspan(kHeader);
  const bool whole_is_secured = !rest.empty() && byte_at(rest, 0) == kSecuredMessagePrefix;
  while (!rest.empty()) {
    if (rest.size() < kSubmessageHeader) return false;
    const std::uint8_t kind = byte_at(rest, 0);
    const bool little = (byte_at(rest, 1) & kLittleEndian) != 0;
    const std::size_t length =
        little ? byte_at(rest, 2) | byte_at(rest, 3) << 8U : byte_at(rest, 3) | byte_at(rest, 2) << 8U;
    // Zero: up to the end.
    const bool to_end = length == 0 && kind != kPad && kind != kInfoTimestamp;
    const std::size_t size = to_end ? rest.size() : kSubmessageHeader + length;
    if (size > rest.size() || size % 4 != 0) return false;
    const bool is_sample = kind == kData || kind == kDataFragment;
    if (is_sample && !whole_is_secured && !is_acceptable_sample(rest.first(size), secured)) return false;
    rest = rest.subspan(size);
  }
  return true;
}

}  // namespace plchost::dds
