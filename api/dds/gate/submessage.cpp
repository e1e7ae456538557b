#include "api/dds/gate/submessage.hpp"

#include <limits>

namespace plchost::dds {

namespace {

constexpr std::size_t kEndOfParameters = 1;

/// The bytes behind a list of parameters; nothing: it does not end, or has a part that does not fit.
std::span<const std::byte> behind_parameters(std::span<const std::byte> rest, bool little) noexcept {
  constexpr std::size_t kParameterHeader = 4;
  while (rest.size() >= kParameterHeader) {
    const std::size_t size = number_at<std::uint16_t>(rest, 2, little);
    if (number_at<std::uint16_t>(rest, 0, little) == kEndOfParameters) return rest.subspan(kParameterHeader);
    if (size % 4 != 0 || size > rest.size() - kParameterHeader) break;
    rest = rest.subspan(kParameterHeader + size);
  }
  return {};
}

}  // namespace

std::optional<Submessage> first_submessage(std::span<const std::byte> rest) noexcept {
  if (rest.size() < kSubmessageHeader) return std::nullopt;
  const Submessage submessage{rest};
  const std::size_t length = number_at<std::uint16_t>(rest, 2, submessage.little());
  // Zero: up to the end.
  const bool to_end = length == 0 && submessage.kind() != submessage_kind::kPad &&
                      submessage.kind() != submessage_kind::kInfoTimestamp;
  const std::size_t size = to_end ? rest.size() : kSubmessageHeader + length;
  if (size > rest.size() || size % 4 != 0) return std::nullopt;
  return Submessage{rest.first(size)};
}

bool is_frame(std::uint8_t kind) noexcept {
  using namespace submessage_kind;
  return kind == kPad || kind == kInfoTimestamp || kind == kInfoDestination || kind >= kVendors;
}

void begin_submessage(std::span<std::byte> bytes, std::uint8_t kind, bool little) noexcept {
  bytes[0] = std::byte{kind};
  bytes[1] = std::byte{little ? kLittleEndian : std::uint8_t{0}};
  put_number(bytes, 2, static_cast<std::uint16_t>(bytes.size() - kSubmessageHeader), little);
}

// The length is written anew, because 0 would mean that padding ends here.
bool turn_into_padding(std::span<std::byte> bytes) noexcept {
  if (bytes.size() - kSubmessageHeader > std::numeric_limits<std::uint16_t>::max()) return false;
  begin_submessage(bytes, submessage_kind::kPad, true);
  return true;
}

std::size_t fields_of_sample(const Submessage& sample) noexcept {
  const std::size_t fields = sample.kind() == submessage_kind::kData ? kDataFields : kFragmentFields;
  const std::size_t begin = kInlineQosCount + 2 + fields;
  if (sample.bytes.size() < begin ||
      number_at<std::uint16_t>(sample.bytes, kInlineQosCount, sample.little()) != fields) {
    return 0;
  }
  return begin;
}

std::span<const std::byte> contents_of_sample(const Submessage& sample) noexcept {
  const std::size_t begin = fields_of_sample(sample);
  if (begin == 0) return {};
  const auto rest = sample.bytes.subspan(begin);
  return (sample.flags() & kHasInlineQos) != 0 ? behind_parameters(rest, sample.little()) : rest;
}

}  // namespace plchost::dds
