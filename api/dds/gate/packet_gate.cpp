#include "api/dds/gate/packet_gate.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

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

bool is_acceptable_sample(const Submessage& sample, bool secured) noexcept {
  if (sample.bytes.size() < kWriterEntity + sizeof(EntityId)) return false;
  const bool is_fragment = sample.kind() == kDataFragment;
  const EntityId writer = sample.writer();
  if (writer == kParticipantWriter) return is_well_formed_sample(sample) && !(secured && is_fragment);
  if (writer != kHandshakeWriter) return !secured;
  const std::uint8_t is_key = is_fragment ? kFragmentIsOfKey : kDataIsKey;
  return is_well_formed_sample(sample) && (sample.flags() & is_key) == 0;
}

// All but samples that a secured host is told in messages that are not signed as a whole. What is a vendor's
// own is skipped by all others.
bool is_said_before_keys(std::uint8_t kind) noexcept {
  constexpr std::array kKinds{kPad,           kAckNack,         kHeartbeat,     kGap,
                              kInfoTimestamp, kInfoDestination, kNackFragment,  kHeartbeatFragment,
                              kSecuredBody,   kSecuredPrefix,   kSecuredPostfix};
  constexpr std::uint8_t kVendors = 0x80;
  return kind >= kVendors || std::ranges::find(kKinds, kind) != kKinds.end();
}

}  // namespace

bool is_acceptable(std::span<const std::byte> datagram, bool secured) noexcept {
  constexpr std::array<std::uint8_t, 5> kRtps2{'R', 'T', 'P', 'S', 2};
  if (datagram.size() < kRtpsHeader) return false;
  for (std::size_t i = 0; i < kRtps2.size(); ++i) {
    if (byte_at(datagram, i) != kRtps2[i]) return false;
  }
  auto rest = datagram.subspan(kRtpsHeader);
  const bool whole_is_secured = !rest.empty() && byte_at(rest, 0) == kSecuredMessagePrefix;
  while (!rest.empty()) {
    const auto submessage = first_submessage(rest);
    if (!submessage) return false;
    const bool is_sample = submessage->kind() == kData || submessage->kind() == kDataFragment;
    if (!whole_is_secured) {
      if (is_sample && !is_acceptable_sample(*submessage, secured)) return false;
      if (!is_sample && secured && !is_said_before_keys(submessage->kind())) return false;
    }
    rest = rest.subspan(submessage->bytes.size());
  }
  return true;
}

}  // namespace plchost::dds
