#include "api/dds/gate/parameter_filter.hpp"

#include <algorithm>
#include <array>

#include "api/dds/gate/submessage.hpp"

namespace plchost::dds {

namespace {

// RTPS 2.5, chapter 9.6.4; those above 0x8000 are Cyclone's own.
enum class Form : std::uint8_t {
  sized,
  guid,
  builtin_endpoints,
  locator,
  text,
  texts,
  octets,
  codes,
  version,
  token
};

struct Rule {
  std::uint16_t parameter;
  Form form;
  std::uint16_t size = 0;  ///< of Form::sized, in bytes
};

constexpr std::uint16_t kPadding = 0x0000;
constexpr std::uint16_t kEnd = 0x0001;
constexpr std::uint16_t kKeyHash = 0x0070;
constexpr std::uint16_t kStatusInfo = 0x0071;
/// A reader that does not know the parameter has to refuse the whole list: Cyclone does so without parsing.
constexpr std::uint16_t kMustBeKnown = 0x4000;
/// Each vendor gives these numbers a meaning of its own: a parameter that is not of Cyclone's form is another
/// vendor's.
constexpr std::uint16_t kOfAVendor = 0x8000;

constexpr std::array kRules{
    Rule{.parameter = 0x0002, .form = Form::sized, .size = 8},   // lease
    Rule{.parameter = 0x0004, .form = Form::sized, .size = 8},   // time-based filter
    Rule{.parameter = 0x0005, .form = Form::text},               // topic
    Rule{.parameter = 0x0006, .form = Form::sized, .size = 4},   // ownership strength
    Rule{.parameter = 0x0007, .form = Form::text},               // type
    Rule{.parameter = 0x000f, .form = Form::sized, .size = 4},   // domain
    Rule{.parameter = 0x0015, .form = Form::sized, .size = 4},   // protocol
    Rule{.parameter = 0x0016, .form = Form::sized, .size = 4},   // vendor
    Rule{.parameter = 0x001a, .form = Form::sized, .size = 12},  // reliability
    Rule{.parameter = 0x001b, .form = Form::sized, .size = 12},  // liveliness
    Rule{.parameter = 0x001d, .form = Form::sized, .size = 4},   // durability
    Rule{.parameter = 0x001e, .form = Form::sized, .size = 28},  // durability service
    Rule{.parameter = 0x001f, .form = Form::sized, .size = 4},   // ownership
    Rule{.parameter = 0x0021, .form = Form::sized, .size = 8},   // presentation
    Rule{.parameter = 0x0023, .form = Form::sized, .size = 8},   // deadline
    Rule{.parameter = 0x0025, .form = Form::sized, .size = 4},   // destination order
    Rule{.parameter = 0x0027, .form = Form::sized, .size = 8},   // latency budget
    Rule{.parameter = 0x0029, .form = Form::texts},              // partition
    Rule{.parameter = 0x002b, .form = Form::sized, .size = 8},   // lifespan
    Rule{.parameter = 0x002c, .form = Form::octets},             // user data
    Rule{.parameter = 0x002d, .form = Form::octets},             // group data
    Rule{.parameter = 0x002e, .form = Form::octets},             // topic data
    Rule{.parameter = 0x002f, .form = Form::locator},            // unicast
    Rule{.parameter = 0x0030, .form = Form::locator},            // multicast
    Rule{.parameter = 0x0031, .form = Form::locator},            // default unicast
    Rule{.parameter = 0x0032, .form = Form::locator},            // unicast for discovery
    Rule{.parameter = 0x0033, .form = Form::locator},            // multicast for discovery
    Rule{.parameter = 0x0034, .form = Form::sized, .size = 4},   // liveliness count
    Rule{.parameter = 0x0040, .form = Form::sized, .size = 8},   // history
    Rule{.parameter = 0x0041, .form = Form::sized, .size = 12},  // resource limits
    Rule{.parameter = 0x0043, .form = Form::sized, .size = 4},   // expects inline QoS
    Rule{.parameter = 0x0044, .form = Form::builtin_endpoints},  // as 0x0058, of old
    Rule{.parameter = 0x0048, .form = Form::locator},            // default multicast
    Rule{.parameter = 0x0049, .form = Form::sized, .size = 4},   // transport priority
    Rule{.parameter = 0x0050, .form = Form::guid},               // of the participant
    Rule{.parameter = 0x0052, .form = Form::sized, .size = 16},  // of the publisher or subscriber
    Rule{.parameter = 0x0058, .form = Form::builtin_endpoints},  // builtin endpoint set
    Rule{.parameter = 0x005a, .form = Form::guid},               // of the reader or writer
    Rule{.parameter = 0x0062, .form = Form::text},               // name of the entity
    Rule{.parameter = kKeyHash, .form = Form::sized, .size = 16},
    Rule{.parameter = kStatusInfo, .form = Form::sized, .size = 4},
    Rule{.parameter = 0x0073, .form = Form::codes},              // data representation
    Rule{.parameter = 0x1001, .form = Form::token},              // identity
    Rule{.parameter = 0x1002, .form = Form::token},              // permissions
    Rule{.parameter = 0x1005, .form = Form::token},              // security info of the participant
    Rule{.parameter = 0x1006, .form = Form::token},              // status of the identity
    Rule{.parameter = 0x4014, .form = Form::text},               // tag of the domain
    Rule{.parameter = 0x8002, .form = Form::sized, .size = 16},  // reader data lifecycle
    Rule{.parameter = 0x8003, .form = Form::sized, .size = 4},   // writer data lifecycle
    Rule{.parameter = 0x8007, .form = Form::version},            // of Cyclone
    Rule{.parameter = 0x800c, .form = Form::sized, .size = 4},   // entity factory
    Rule{.parameter = 0x8010, .form = Form::sized, .size = 12},  // reader lifespan
    Rule{.parameter = 0x8019, .form = Form::sized, .size = 4},   // size of the receive buffer
    Rule{.parameter = 0x801c, .form = Form::sized, .size = 4},   // requests key hashes
    Rule{.parameter = 0x801d, .form = Form::sized, .size = 4},   // redundant networking
};
static_assert(std::ranges::is_sorted(kRules, {}, &Rule::parameter));

/// Participants, publications, subscriptions and liveliness: no others pass the gate of an unsecured host.
constexpr std::uint32_t kBuiltinEndpoints = 0x0000'0c3f;
/// Cyclone sends to each address that a participant names.
constexpr int kMostLocators = 32;

constexpr std::size_t kHeader = 4;
constexpr std::size_t kLength = 4;
constexpr std::size_t kGuid = 16;
constexpr std::size_t kLocator = 24;
constexpr std::size_t kVersionNumbers = 20;

/// The size of a text with what fills it up; 0: it does not fit.
std::size_t size_of_text(std::span<const std::byte> value, bool little) noexcept {
  if (value.size() < kLength) return 0;
  const std::size_t length = number_at<std::uint32_t>(value, 0, little);
  if (length == 0 || length > value.size() - kLength) return 0;
  if (byte_at(value, kLength + length - 1) != 0) return 0;
  return std::min(value.size(), kLength + (length + 3) / 4 * 4);
}

bool is_sequence(std::span<const std::byte> value, bool little, std::size_t element) noexcept {
  return value.size() >= kLength &&
         number_at<std::uint32_t>(value, 0, little) <= (value.size() - kLength) / element;
}

bool are_texts(std::span<const std::byte> value, bool little) noexcept {
  if (!is_sequence(value, little, kLength + 1)) return false;
  std::uint32_t left = number_at<std::uint32_t>(value, 0, little);
  for (value = value.subspan(kLength); left > 0; --left) {
    const std::size_t size = size_of_text(value, little);
    if (size == 0) return false;
    value = value.subspan(size);
  }
  return true;
}

void keep_builtin_endpoints(std::span<std::byte> value, bool little) noexcept {
  for (std::size_t i = 0; i < kLength; ++i) {
    const std::size_t place = little ? i : kLength - 1 - i;
    value[i] &= static_cast<std::byte>(kBuiltinEndpoints >> (8 * place));
  }
}

bool has_form(std::span<std::byte> value, const Rule& rule, bool little, ParameterList kind,
              std::span<const std::byte> guid_prefix) noexcept {
  switch (rule.form) {
    case Form::sized:
      return value.size() == rule.size;
    case Form::guid:
      return value.size() == kGuid && std::ranges::equal(value.first(guid_prefix.size()), guid_prefix);
    case Form::builtin_endpoints:
      if (value.size() != kLength) return false;
      if (kind == ParameterList::discovery) keep_builtin_endpoints(value, little);
      return true;
    case Form::locator:
      return value.size() == kLocator;
    case Form::text:
      return size_of_text(value, little) != 0;
    case Form::texts:
      return are_texts(value, little);
    case Form::octets:
      return is_sequence(value, little, 1);
    case Form::codes:
      return is_sequence(value, little, sizeof(std::uint16_t));
    case Form::version:
      return value.size() > kVersionNumbers && size_of_text(value.subspan(kVersionNumbers), little) != 0;
    case Form::token:
      return true;
  }
  return false;
}

const Rule* rule_of(std::uint16_t parameter, ParameterList kind) noexcept {
  if (kind == ParameterList::inline_qos && parameter != kKeyHash && parameter != kStatusInfo) return nullptr;
  const auto* const rule = std::ranges::lower_bound(kRules, parameter, {}, &Rule::parameter);
  if (rule == kRules.end() || rule->parameter != parameter) return nullptr;
  return rule->form != Form::token || kind == ParameterList::secured_discovery ? rule : nullptr;
}

}  // namespace

std::size_t filter_parameters(std::span<std::byte> list, bool little, ParameterList kind,
                              std::span<const std::byte> guid_prefix) noexcept {
  int locators = 0;
  for (std::size_t at = 0; list.size() - at >= kHeader;) {
    const auto rest = list.subspan(at);
    const auto parameter = number_at<std::uint16_t>(rest, 0, little);
    const std::size_t size = number_at<std::uint16_t>(rest, 2, little);
    at += kHeader;
    if (parameter == kEnd) return at;
    if (size % 4 != 0 || size > list.size() - at) return 0;
    at += size;
    if (parameter == kPadding) continue;
    const Rule* const rule = rule_of(parameter, kind);
    const bool fits =
        rule != nullptr && has_form(rest.subspan(kHeader, size), *rule, little, kind, guid_prefix);
    if (fits) {
      if (rule->form == Form::locator && ++locators > kMostLocators) return 0;
    } else if (rule != nullptr && (parameter & kOfAVendor) == 0) {
      return 0;
    } else if ((parameter & kMustBeKnown) == 0) {
      std::ranges::fill(rest.first(sizeof parameter), std::byte{0});
    }
  }
  return 0;
}

}  // namespace plchost::dds
