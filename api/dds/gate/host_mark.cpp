#include "api/dds/gate/host_mark.hpp"

#include <cstdint>

#include <fmt/format.h>

#include "api/dds/gate/submessage.hpp"

namespace plchost::dds {

namespace {

constexpr std::string_view kOfAHost = "plchost host: ";
constexpr std::string_view kWithBlocks = " with blocks";

constexpr std::uint16_t kEndOfList = 0x0001;
constexpr std::uint16_t kUserData = 0x002c;

// The octets of a participant's user data. Empty: it has none.
std::string_view user_data_of(std::span<const std::byte> contents) noexcept {
  constexpr std::size_t kParameterHeader = 4;
  constexpr std::size_t kNumberOfOctets = 4;
  if (contents.size() < kEncapsulation) return {};
  const bool little = (byte_at(contents, 1) & 1U) != 0;
  for (auto rest = contents.subspan(kEncapsulation); rest.size() >= kParameterHeader;) {
    const auto parameter = number_at<std::uint16_t>(rest, 0, little);
    const std::size_t size = number_at<std::uint16_t>(rest, 2, little);
    rest = rest.subspan(kParameterHeader);
    if (parameter == kEndOfList || size > rest.size()) break;
    if (parameter == kUserData && size >= kNumberOfOctets) {
      const std::size_t count = number_at<std::uint32_t>(rest, 0, little);
      if (count > size - kNumberOfOctets) break;
      return {reinterpret_cast<const char*>(rest.data() + kNumberOfOctets), count};
    }
    rest = rest.subspan(size);
  }
  return {};
}

// Whether the submessage announces such a host.
bool is_of_another_host(const Submessage& submessage, const HostMark& own) noexcept {
  if (submessage.kind() != submessage_kind::kData || fields_of_sample(submessage) == 0 ||
      submessage.writer() != kParticipantWriter) {
    return false;
  }
  const auto mark = host_mark_of(user_data_of(contents_of_sample(submessage)));
  return mark && !concern_each_other(own, *mark);
}

}  // namespace

std::string words_of(const HostMark& mark) {
  return fmt::format("{}{}{}", kOfAHost, mark.name, mark.sends_blocks ? kWithBlocks : "");
}

std::optional<HostMark> host_mark_of(std::string_view words) noexcept {
  if (!words.starts_with(kOfAHost)) return std::nullopt;
  words.remove_prefix(kOfAHost.size());
  const bool sends_blocks = words.ends_with(kWithBlocks);
  if (sends_blocks) words.remove_suffix(kWithBlocks.size());
  if (words.empty() || words.contains(' ')) return std::nullopt;
  return HostMark{.name = words, .sends_blocks = sends_blocks};
}

bool concern_each_other(const HostMark& one, const HostMark& other) noexcept {
  return one.name == other.name || (one.sends_blocks && other.sends_blocks);
}

std::size_t take_out_other_hosts(std::span<std::byte> datagram, const HostMark& own) noexcept {
  if (datagram.size() < kRtpsHeader) return datagram.size();
  bool is_cut = false;
  bool says_something = false;
  for (auto rest = datagram.subspan(kRtpsHeader); !rest.empty();) {
    const auto submessage = first_submessage(rest);
    if (!submessage) return datagram.size();
    const auto part = rest.first(submessage->bytes.size());
    rest = rest.subspan(part.size());
    if (is_of_another_host(*submessage, own) && turn_into_padding(part)) {
      is_cut = true;
    } else {
      says_something |= !is_frame(submessage->kind());
    }
  }
  return is_cut && !says_something ? 0 : datagram.size();
}

}  // namespace plchost::dds
