#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace plchost::dds {

// RTPS 2.5, chapter 9.4; DDS Security 1.1, chapter 7.3.
inline constexpr std::size_t kRtpsHeader = 20;
inline constexpr std::size_t kSubmessageHeader = 4;

namespace submessage_kind {
inline constexpr std::uint8_t kPad = 0x01;
inline constexpr std::uint8_t kAckNack = 0x06;
inline constexpr std::uint8_t kHeartbeat = 0x07;
inline constexpr std::uint8_t kGap = 0x08;
inline constexpr std::uint8_t kInfoTimestamp = 0x09;
inline constexpr std::uint8_t kInfoSource = 0x0c;
inline constexpr std::uint8_t kInfoReplyIp4 = 0x0d;
inline constexpr std::uint8_t kInfoDestination = 0x0e;
inline constexpr std::uint8_t kInfoReply = 0x0f;
inline constexpr std::uint8_t kNackFragment = 0x12;
inline constexpr std::uint8_t kHeartbeatFragment = 0x13;
inline constexpr std::uint8_t kData = 0x15;
inline constexpr std::uint8_t kDataFragment = 0x16;
inline constexpr std::uint8_t kSecuredBody = 0x30;
inline constexpr std::uint8_t kSecuredPrefix = 0x31;
inline constexpr std::uint8_t kSecuredPostfix = 0x32;
inline constexpr std::uint8_t kSecuredMessagePrefix = 0x33;
inline constexpr std::uint8_t kVendors = 0x80;  ///< from here on: a vendor's own, which all others skip
}  // namespace submessage_kind

inline constexpr std::uint8_t kLittleEndian = 0x01;
inline constexpr std::uint8_t kHasInlineQos = 0x02;
inline constexpr std::uint8_t kDataHasContents = 0x04;
inline constexpr std::uint8_t kDataIsKey = 0x08;
inline constexpr std::uint8_t kFragmentIsOfKey = 0x04;
/// In a sample: where the octets to the inline QoS are counted from, the reader's and the writer's entity.
inline constexpr std::size_t kInlineQosCount = kSubmessageHeader + 2;
inline constexpr std::size_t kReaderEntity = kSubmessageHeader + 4;
inline constexpr std::size_t kWriterEntity = kSubmessageHeader + 8;
/// Two words, the upper one first.
inline constexpr std::size_t kSampleNumber = kSubmessageHeader + 12;
/// All that stands between that count and the inline QoS.
inline constexpr std::size_t kDataFields = 16;
inline constexpr std::size_t kFragmentFields = 28;
/// The beginning of contents.
inline constexpr std::size_t kEncapsulation = 4;

using EntityId = std::array<std::uint8_t, 4>;
inline constexpr EntityId kParticipantWriter{0x00, 0x01, 0x00, 0xc2};
inline constexpr EntityId kHandshakeWriter{0x00, 0x02, 0x01, 0xc3};
inline constexpr EntityId kPublicationsWriter{0x00, 0x00, 0x03, 0xc2};
inline constexpr EntityId kSubscriptionsWriter{0x00, 0x00, 0x04, 0xc2};
inline constexpr EntityId kLivelinessWriter{0x00, 0x02, 0x00, 0xc2};
/// In the last octet of an entity of the standard's own.
inline constexpr std::uint8_t kBuiltinEntity = 0xc0;
/// In the header of a message: its sender.
inline constexpr std::size_t kGuidPrefixAt = 8;
inline constexpr std::size_t kGuidPrefix = 12;

[[nodiscard]] inline std::uint8_t byte_at(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return std::to_integer<std::uint8_t>(bytes[at]);
}

/// A number of two or four bytes.
template <class Number>
[[nodiscard]] Number number_at(std::span<const std::byte> bytes, std::size_t at, bool little) noexcept {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    const std::size_t place = little ? i : sizeof(Number) - 1 - i;
    number |= std::uint32_t{byte_at(bytes, at + i)} << (8 * place);
  }
  return static_cast<Number>(number);
}

template <class Number>
void put_number(std::span<std::byte> bytes, std::size_t at, Number number, bool little) noexcept {
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    const std::size_t place = little ? i : sizeof(Number) - 1 - i;
    bytes[at + i] = static_cast<std::byte>(std::uint32_t{number} >> (8 * place) & 0xffU);
  }
}

/// A part of an RTPS message, header included.
struct Submessage {
  std::span<const std::byte> bytes;

  [[nodiscard]] std::uint8_t kind() const noexcept { return byte_at(bytes, 0); }
  [[nodiscard]] std::uint8_t flags() const noexcept { return byte_at(bytes, 1); }
  [[nodiscard]] bool little() const noexcept { return (flags() & kLittleEndian) != 0; }
  /// Of a sample.
  [[nodiscard]] EntityId writer() const noexcept {
    EntityId writer{};
    for (std::size_t i = 0; i < writer.size(); ++i) writer[i] = byte_at(bytes, kWriterEntity + i);
    return writer;
  }
};

/// From here on the message is of another participant, of the same process: Cyclone sends what several of
/// them say together.
inline constexpr std::size_t kInfoSourceSize = 24;
inline constexpr std::size_t kInfoSourceVersion = 8;
inline constexpr std::size_t kInfoSourcePrefix = 12;

/// The first of what is left of a message, which is not empty. Nothing: it does not fit.
[[nodiscard]] std::optional<Submessage> first_submessage(std::span<const std::byte> rest) noexcept;

/// Whether `is_good(prefix)` is true for each participant that a message says to be of; false, too, if it is
/// malformed.
template <class Predicate>
[[nodiscard]] bool every_sender(std::span<const std::byte> datagram, Predicate is_good) {
  if (datagram.size() < kRtpsHeader || !is_good(datagram.subspan<kGuidPrefixAt, kGuidPrefix>())) return false;
  for (auto rest = datagram.subspan(kRtpsHeader); !rest.empty();) {
    const auto submessage = first_submessage(rest);
    if (!submessage) return false;
    rest = rest.subspan(submessage->bytes.size());
    if (submessage->kind() != submessage_kind::kInfoSource) continue;
    if (submessage->bytes.size() != kInfoSourceSize ||
        !is_good(submessage->bytes.subspan<kInfoSourcePrefix, kGuidPrefix>())) {
      return false;
    }
  }
  return true;
}

/// Whether a submessage of this kind says nothing by itself.
[[nodiscard]] bool is_frame(std::uint8_t kind) noexcept;

/// Writes the header of a submessage that has all of `bytes`.
void begin_submessage(std::span<std::byte> bytes, std::uint8_t kind, bool little) noexcept;

/// Makes a submessage one that says nothing, of the same size. False: it is too large for that.
[[nodiscard]] bool turn_into_padding(std::span<std::byte> bytes) noexcept;

/// Where the inline QoS of a sample begins, or its contents if it has none. Zero: its fields are not where
/// all vendors put them.
[[nodiscard]] std::size_t fields_of_sample(const Submessage& sample) noexcept;

/// The contents of a sample, behind its inline QoS. Empty: its fields are not where all vendors put them, or
/// there is nothing.
[[nodiscard]] std::span<const std::byte> contents_of_sample(const Submessage& sample) noexcept;

}  // namespace plchost::dds
