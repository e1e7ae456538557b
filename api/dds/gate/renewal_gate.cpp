#include "api/dds/gate/renewal_gate.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace plchost::dds {

namespace {

using namespace submessage_kind;

// In the contents: behind the encapsulation, this message's identity and that of the one that it answers.
constexpr std::size_t kDestination = kEncapsulation + 24 + 24;
// Behind the GUIDs of the destination, its endpoint and the source's endpoint.
constexpr std::size_t kMessageClass = kDestination + 48;

// How a message whose class ends so calls its sender's own challenge and the one that it answers.
struct ChallengeNames {
  std::string_view class_ends_with;
  std::string_view own;
  std::string_view answered;  ///< empty: it answers none
};
constexpr std::array kChallengeNames{ChallengeNames{"+AuthReq", "future_challenge", ""},
                                     ChallengeNames{"+Req", "challenge1", ""},
                                     ChallengeNames{"+Reply", "challenge2", "challenge1"},
                                     ChallengeNames{"+Final", "challenge1", "challenge2"}};

// A text with its end.
std::size_t find_text(std::string_view where, std::string_view text) noexcept {
  for (std::size_t at = where.find(text); at < where.size(); at = where.find(text, at + 1)) {
    if (at + text.size() < where.size() && where[at + text.size()] == '\0') return at;
  }
  return std::string_view::npos;
}

// Such that this side can renew a lease by it.
bool is_plain(std::uint8_t kind) noexcept {
  constexpr std::array kKinds{kData, kDataFragment, kAckNack, kHeartbeat, kHeartbeatFragment,
                              kGap,  kNackFragment};
  return std::ranges::find(kKinds, kind) != kKinds.end();
}

// Of a property with that name; empty: there is none of that size.
std::span<const std::byte> challenge_in(std::span<const std::byte> contents, std::string_view name) noexcept {
  const std::size_t at = find_text({reinterpret_cast<const char*>(contents.data()), contents.size()}, name);
  if (at == std::string_view::npos) return {};
  // The name, up to a full word; the size of the value; the value.
  const bool little = (byte_at(contents, 1) & kLittleEndian) != 0;
  const std::size_t size_at = (at + name.size() + 1 + 3) / 4 * 4;
  const std::size_t value_at = size_at + sizeof(std::uint32_t);
  if (contents.size() < value_at + kChallenge ||
      number_at<std::uint32_t>(contents, size_at, little) != kChallenge) {
    return {};
  }
  return contents.subspan(value_at, kChallenge);
}

// As Cyclone reads it: of the first token.
std::string_view class_in(std::span<const std::byte> contents) noexcept {
  const bool little = (byte_at(contents, 1) & kLittleEndian) != 0;
  std::size_t at = kMessageClass;
  const auto has = [&](std::size_t size) { return at <= contents.size() && contents.size() - at >= size; };
  if (!has(sizeof(std::uint32_t))) return {};
  const std::size_t skipped = number_at<std::uint32_t>(contents, at, little);
  // The message's class, up to a full word; the number of tokens.
  at = (at + sizeof(std::uint32_t) + skipped + 3) / 4 * 4 + sizeof(std::uint32_t);
  if (!has(sizeof(std::uint32_t))) return {};
  const std::size_t size = number_at<std::uint32_t>(contents, at, little);
  at += sizeof(std::uint32_t);
  if (!has(size)) return {};
  const std::string_view text(reinterpret_cast<const char*>(contents.data()) + at, size);
  return text.substr(0, text.find('\0'));
}

SignUse use_of(const Submessage& submessage, std::span<const std::byte> from,
               const HandshakeRecord& record) noexcept {
  constexpr std::size_t kLeast = kInlineQosCount + 2 + kDataFields;
  if (submessage.kind() != kData || submessage.bytes.size() < kLeast ||
      submessage.writer() != kHandshakeWriter) {
    return SignUse::usual;
  }
  const auto sign = read_handshake_sign(contents_of_sample(submessage));
  if (sign) return record.take(from, *sign);
  return sign.error() == NoSign::incomplete ? SignUse::none : SignUse::usual;
}

}  // namespace

std::expected<HandshakeSign, NoSign> read_handshake_sign(std::span<const std::byte> contents) noexcept {
  if (contents.size() < kMessageClass) return std::unexpected(NoSign::another_class);
  const auto names = std::ranges::find_if(
      kChallengeNames,
      [text = class_in(contents)](const ChallengeNames& of) { return text.ends_with(of.class_ends_with); });
  if (names == kChallengeNames.end()) return std::unexpected(NoSign::another_class);
  const auto own = challenge_in(contents, names->own);
  const auto answered =
      names->answered.empty() ? std::span<const std::byte>{} : challenge_in(contents, names->answered);
  if (own.empty() || (answered.empty() && !names->answered.empty()))
    return std::unexpected(NoSign::incomplete);
  return HandshakeSign{.to = contents.subspan<kDestination, kGuidPrefix>(),
                       .challenge = own.first<kChallenge>(),
                       .answered = answered};
}

std::size_t take_out_doubted(std::span<std::byte> datagram, const HandshakeRecord& record) noexcept {
  if (datagram.size() <= kRtpsHeader || byte_at(datagram, kRtpsHeader) == kSecuredMessagePrefix) {
    return datagram.size();
  }
  std::span<const std::byte> from = datagram.subspan(kGuidPrefixAt, kGuidPrefix);
  bool says_something = false;
  for (auto rest = datagram.subspan(kRtpsHeader); !rest.empty();) {
    const auto submessage = first_submessage(rest);
    if (!submessage) return 0;
    const auto part = rest.first(submessage->bytes.size());
    rest = rest.subspan(part.size());
    const std::uint8_t kind = submessage->kind();
    if (kind == kInfoSource && part.size() == kInfoSourceSize)
      from = part.subspan(kInfoSourcePrefix, kGuidPrefix);
    const SignUse use = is_plain(kind) ? use_of(*submessage, from, record) : SignUse::awaited;
    if (use == SignUse::awaited || (use == SignUse::usual && !record.is_doubted(from))) {
      says_something |= !is_frame(kind);
    } else if (!turn_into_padding(part)) {
      return 0;
    }
  }
  return says_something ? datagram.size() : 0;
}

}  // namespace plchost::dds
