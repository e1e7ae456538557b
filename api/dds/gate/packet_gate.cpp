#include "api/dds/gate/packet_gate.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "api/dds/gate/parameter_filter.hpp"
#include "api/dds/gate/submessage.hpp"

namespace plchost::dds {

namespace {

using namespace submessage_kind;

// A sample of one of the two writers that speak in plain text: fields as all vendors lay them out, then what
// it says.
bool is_well_formed_sample(const Submessage& sample) noexcept {
  const bool has_contents = (sample.flags() & kDataHasContents) != 0;
  const bool is_key = (sample.flags() & kDataIsKey) != 0;
  if (sample.kind() == kData && has_contents == is_key) return false;
  return contents_of_sample(sample).size() >= kEncapsulation;
}

// XCDR1 encapsulations, in network order.
constexpr std::uint16_t kCdr = 0x0000;
constexpr std::uint16_t kParameters = 0x0002;
constexpr std::uint16_t kLittleEncapsulation = 0x0001;

bool admit_parameters(std::span<std::byte> contents, ParameterList kind,
                      std::span<const std::byte> guid_prefix) noexcept {
  const auto encapsulation = number_at<std::uint16_t>(contents, 0, false);
  if ((encapsulation & ~kLittleEncapsulation) != kParameters) return false;
  const bool little = (encapsulation & kLittleEncapsulation) != 0;
  return filter_parameters(contents.subspan(kEncapsulation), little, kind, guid_prefix) != 0;
}

// A participant's own GUID prefix and a kind; then, if it is no key, octets.
bool is_liveliness(std::span<const std::byte> contents, bool is_key,
                   std::span<const std::byte> guid_prefix) noexcept {
  constexpr std::size_t kKey = 16;
  const auto encapsulation = number_at<std::uint16_t>(contents, 0, false);
  const auto data = contents.subspan(kEncapsulation);
  if ((encapsulation & ~kLittleEncapsulation) != kCdr || data.size() < kKey) return false;
  if (!std::ranges::equal(data.first(kGuidPrefix), guid_prefix)) return false;
  if (is_key) return true;
  const bool little = (encapsulation & kLittleEncapsulation) != 0;
  return data.size() >= kKey + 4 && number_at<std::uint32_t>(data, kKey, little) <= data.size() - kKey - 4;
}

// Of a secured host, in plain text.
bool admit_sample_before_keys(std::span<std::byte> bytes, std::span<const std::byte> guid_prefix) noexcept {
  const Submessage sample{bytes};
  if (!is_well_formed_sample(sample)) return false;
  const bool is_fragment = sample.kind() == kDataFragment;
  const EntityId writer = sample.writer();
  if (writer == kParticipantWriter) {
    const auto contents = bytes.last(contents_of_sample(sample).size());
    return !is_fragment && admit_parameters(contents, ParameterList::secured_discovery, guid_prefix);
  }
  const std::uint8_t is_key = is_fragment ? kFragmentIsOfKey : kDataIsKey;
  return writer == kHandshakeWriter && (sample.flags() & is_key) == 0;
}

// All but samples that a secured host is told in messages that are not signed as a whole.
bool is_said_before_keys(std::uint8_t kind) noexcept {
  constexpr std::array kKinds{kPad,           kAckNack,         kHeartbeat,     kGap,
                              kInfoTimestamp, kInfoDestination, kNackFragment,  kHeartbeatFragment,
                              kSecuredBody,   kSecuredPrefix,   kSecuredPostfix};
  return kind >= kVendors || std::ranges::find(kKinds, kind) != kKinds.end();
}

// All but samples that an unsecured host is told. Cyclone does not look into the replies.
bool is_said_without_security(std::uint8_t kind) noexcept {
  constexpr std::array kKinds{kPad,          kAckNack,           kHeartbeat,    kGap,       kInfoTimestamp,
                              kNackFragment, kHeartbeatFragment, kInfoReplyIp4, kInfoReply, kInfoDestination};
  return kind >= kVendors || std::ranges::find(kKinds, kind) != kKinds.end();
}

bool admit_builtin_contents(std::span<std::byte> contents, const Submessage& sample,
                            std::span<const std::byte> guid_prefix) noexcept {
  const EntityId writer = sample.writer();
  if (writer == kLivelinessWriter) {
    return is_liveliness(contents, (sample.flags() & kDataIsKey) != 0, guid_prefix);
  }
  constexpr std::array kWriters{kParticipantWriter, kPublicationsWriter, kSubscriptionsWriter};
  return std::ranges::find(kWriters, writer) != kWriters.end() &&
         admit_parameters(contents, ParameterList::discovery, guid_prefix);
}

// Of an unsecured host.
bool admit_plain_sample(std::span<std::byte> bytes, std::span<const std::byte> guid_prefix) noexcept {
  const Submessage sample{bytes};
  const std::size_t fields = fields_of_sample(sample);
  if (fields == 0) return false;
  const bool is_fragment = sample.kind() == kDataFragment;
  const bool is_builtin = (sample.writer().back() & kBuiltinEntity) == kBuiltinEntity;
  if (is_builtin && is_fragment) return false;
  auto rest = bytes.subspan(fields);
  const bool has_qos = (sample.flags() & kHasInlineQos) != 0;
  if (has_qos) {
    const std::size_t size = filter_parameters(rest, sample.little(), ParameterList::inline_qos, guid_prefix);
    if (size == 0) return false;
    rest = rest.subspan(size);
  }
  if (!is_fragment) {
    const bool has_contents = (sample.flags() & kDataHasContents) != 0;
    const bool is_key = (sample.flags() & kDataIsKey) != 0;
    if (has_contents && is_key) return false;
    // Which instance is gone stands in the inline QoS.
    if (!has_contents && !is_key) return has_qos;
  }
  if (rest.size() < kEncapsulation) return false;
  return !is_builtin || admit_builtin_contents(rest, sample, guid_prefix);
}

bool is_rtps2(std::span<const std::byte> datagram) noexcept {
  constexpr std::array<std::uint8_t, 5> kRtps2{'R', 'T', 'P', 'S', 2};
  if (datagram.size() < kRtpsHeader) return false;
  for (std::size_t i = 0; i < kRtps2.size(); ++i) {
    if (byte_at(datagram, i) != kRtps2[i]) return false;
  }
  return true;
}

// Of the same version, and so of the same parser.
bool is_info_source(const Submessage& submessage) noexcept {
  constexpr std::uint8_t kMajor = 2;
  return submessage.bytes.size() == kInfoSourceSize &&
         byte_at(submessage.bytes, kInfoSourceVersion) == kMajor;
}

bool admit_submessage(std::span<std::byte> bytes, bool secured,
                      std::span<const std::byte> guid_prefix) noexcept {
  const std::uint8_t kind = Submessage{bytes}.kind();
  if (kind == kData || kind == kDataFragment) {
    return secured ? admit_sample_before_keys(bytes, guid_prefix) : admit_plain_sample(bytes, guid_prefix);
  }
  return secured ? is_said_before_keys(kind) : is_said_without_security(kind);
}

// The samples that clients of a secured host send to it in plain text, too, though it must not believe them.
// Cyclone 0.10.2 sends liveliness so under any governance. It also sends so the end of a reader or writer, of
// which it has forgotten that it was protected.
bool is_said_in_vain(const Submessage& submessage) noexcept {
  constexpr std::array kWriters{kPublicationsWriter, kSubscriptionsWriter, kLivelinessWriter};
  return submessage.kind() == kData && submessage.bytes.size() >= kInlineQosCount + 2 + kDataFields &&
         std::ranges::find(kWriters, submessage.writer()) != kWriters.end();
}

// A gap tells Cyclone that a sample of that number does not come. Without it Cyclone would ask for the
// sample, and its writer would repeat it, for ever. A stranger can say that anyway. False: no gap can stand
// for the sample.
bool turn_into_gap(std::span<std::byte> bytes) noexcept {
  constexpr std::size_t kGapSize = 32;
  const Submessage sample{bytes};
  const bool little = sample.little();
  const auto high = number_at<std::uint32_t>(bytes, kSampleNumber, little);
  const auto low = number_at<std::uint32_t>(bytes, kSampleNumber + 4, little);
  constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
  const bool is_number = high < kMost / 2 && low < kMost && (high != 0 || low != 0);
  if (!is_number || bytes.size() < kGapSize) return false;
  const auto rest = bytes.subspan(kGapSize);
  if (!rest.empty() && !turn_into_padding(rest)) return false;
  // Reader and writer, the first number that does not come, the next one that may, no others.
  std::ranges::copy(bytes.subspan(kReaderEntity, 8), bytes.begin() + kSubmessageHeader);
  constexpr std::size_t kFirstNumber = kSubmessageHeader + 8;
  for (const std::size_t at : {kFirstNumber, kFirstNumber + 8}) put_number(bytes, at, high, little);
  put_number(bytes, kFirstNumber + 4, low, little);
  put_number(bytes, kFirstNumber + 12, low + 1, little);
  put_number(bytes, kFirstNumber + 16, std::uint32_t{0}, little);
  begin_submessage(bytes.first(kGapSize), kGap, little);
  return true;
}

}  // namespace

Admission admit(std::span<std::byte> datagram, bool secured) noexcept {
  if (!is_rtps2(datagram)) return Admission::refused;
  auto rest = datagram.subspan(kRtpsHeader);
  std::span<const std::byte> guid_prefix = datagram.subspan(kGuidPrefixAt, kGuidPrefix);
  const bool whole_is_secured = secured && !rest.empty() && byte_at(rest, 0) == kSecuredMessagePrefix;
  bool is_cut = false;
  bool says_something = false;
  while (!rest.empty()) {
    const auto submessage = first_submessage(rest);
    if (!submessage) return Admission::refused;
    const auto part = rest.first(submessage->bytes.size());
    rest = rest.subspan(part.size());
    if (whole_is_secured) continue;
    const std::uint8_t kind = submessage->kind();
    if (kind == kInfoSource) {
      // Without it, what follows would be of another participant.
      if (!is_info_source(*submessage)) return Admission::refused;
      guid_prefix = submessage->bytes.subspan(kInfoSourcePrefix, kGuidPrefix);
    } else if (admit_submessage(part, secured, guid_prefix) ||
               (secured && is_said_in_vain(*submessage) && turn_into_gap(part))) {
      says_something |= !is_frame(kind);
    } else {
      is_cut = true;
      if (!turn_into_padding(part)) return Admission::refused;
    }
  }
  if (!is_cut) return Admission::whole;
  return says_something ? Admission::cut : Admission::refused;
}

}  // namespace plchost::dds
