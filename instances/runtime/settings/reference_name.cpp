#include "instances/runtime/settings/reference_name.hpp"

#include <algorithm>

#include "instances/runtime/settings/settings_key.hpp"
#include "shm/base/names.hpp"
#include "shm/pages/reference_clock.hpp"

namespace plchost {

namespace {

constexpr std::string_view kPrefix = "ptp:";
constexpr std::string_view kDevices = "/dev/";

// A path outside of /dev, or one that leads out of it, is no device.
bool is_device(std::string_view path) noexcept {
  const auto allowed = [](char c) { return c == '/' || is_name_character(c); };
  return path.starts_with(kDevices) && path.size() > kDevices.size() && !path.ends_with('/') &&
         !path.contains("..") && std::ranges::all_of(path, allowed);
}

}  // namespace

std::optional<ReferenceName> parse_reference(std::string_view text) {
  using Kind = ReferenceName::Kind;
  if (text.size() > kMaxObjectName) return std::nullopt;
  if (is_word(text, "realtime")) return ReferenceName{.kind = Kind::realtime, .text = {}};
  if (is_word(text, "tai")) return ReferenceName{.kind = Kind::tai, .text = {}};
  if (text.starts_with(kPrefix)) {
    const std::string_view path = text.substr(kPrefix.size());
    if (!is_device(path)) return std::nullopt;
    return ReferenceName{.kind = Kind::device, .text = std::string(path)};
  }
  if (!check_reference_name(text)) return std::nullopt;
  return ReferenceName{.kind = Kind::record, .text = std::string(text)};
}

}  // namespace plchost
