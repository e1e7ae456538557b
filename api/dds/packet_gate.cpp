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
constexpr std::uint8_t kHasInlineQos = 0x02;
constexpr std::uint8_t kDataHasContents = 0x04;
constexpr std::uint8_t kDataIsKey = 0x08;
constexpr std::uint8_t kFragmentIsOfKey = 0x04;
/// In a sample: where the octets to the inline QoS are counted from, and the writer's entity.
constexpr std::size_t kInlineQosCount = kSubmessageHeader + 2;
constexpr std::size_t kWriterEntity = kSubmessageHeader + 8;
/// All that stands between that count and the inline QoS.
constexpr std::size_t kDataFields = 16;
constexpr std::size_t kFragmentFields = 28;
constexpr std::size_t kEncapsulation = 4;
constexpr std::size_t kEndOfParameters = 1;

using EntityId = std::array<std::uint8_t, 4>;
constexpr EntityId kParticipantWriter{0x00, 0x01, 0x00, 0xc2};
constexpr EntityId kHandshakeWriter{0x00, 0x02, 0x01, 0xc3};

std::uint8_t byte_at(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return std::to_integer<std::uint8_t>(bytes[at]);
}

std::size_t number_at(std::span<const std::byte> bytes, std::size_t at, bool little) noexcept {
  return std::size_t{byte_at(bytes, little ? at : at + 1)} | std::size_t{byte_at(bytes, little ? at + 1 : at)}
                                                                 << 8U;
}

/// What is behind a list of parameters; nothing: it does not end, or has a part that does not fit.
std::span<const std::byte> behind_parameters(std::span<const std::byte> rest, bool little) noexcept {
  constexpr std::size_t kParameterHeader = 4;
  while (rest.size() >= kParameterHeader) {
    const std::size_t size = number_at(rest, 2, little);
    if (number_at(rest, 0, little) == kEndOfParameters) return rest.subspan(kParameterHeader);
    if (size % 4 != 0 || size > rest.size() - kParameterHeader) break;
    rest = rest.subspan(kParameterHeader + size);
  }
  return {};
}

// A sample of one of the two writers that speak in plain text: fields as all vendors lay them out, then what
// it says.
bool is_well_formed_sample(std::span<const std::byte> submessage, bool little) noexcept {
  const bool is_data = byte_at(submessage, 0) == kData;
  const std::size_t fields = is_data ? kDataFields : kFragmentFields;
  const std::size_t contents = kInlineQosCount + 2 + fields;
  if (submessage.size() < contents || number_at(submessage, kInlineQosCount, little) != fields) return false;
  const std::uint8_t flags = byte_at(submessage, 1);
  if (is_data && ((flags & kDataHasContents) != 0) == ((flags & kDataIsKey) != 0)) return false;
  auto rest = submessage.subspan(contents);
  if ((flags & kHasInlineQos) != 0) rest = behind_parameters(rest, little);
  return rest.size() >= kEncapsulation;
}

bool is_acceptable_sample(std::span<const std::byte> submessage, bool secured) noexcept {
  if (submessage.size() < kWriterEntity + sizeof(EntityId)) return false;
  EntityId writer{};
  for (std::size_t i = 0; i < writer.size(); ++i) writer[i] = byte_at(submessage, kWriterEntity + i);
  const bool is_handshake = writer == kHandshakeWriter;
  if (!is_handshake && writer != kParticipantWriter) return !secured;
  const std::uint8_t flags = byte_at(submessage, 1);
  if (!is_well_formed_sample(submessage, (flags & kLittleEndian) != 0)) return false;
  const std::uint8_t is_key = byte_at(submessage, 0) == kData ? kDataIsKey : kFragmentIsOfKey;
  return !is_handshake || (flags & is_key) == 0;
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
    const std::size_t length = number_at(rest, 2, little);
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
