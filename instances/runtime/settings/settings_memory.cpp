// [SysMem]: where the areas of an application lie. [Retain]: how its retain values are written.
#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "instances/plc_app.h"
#include "instances/runtime/settings/setting_places.hpp"
#include "instances/runtime/settings/settings_key.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

using std::chrono::milliseconds;

constexpr std::string_view kMemory = "SysMem";
constexpr std::string_view kRetain = "Retain";
constexpr std::string_view kDefaultDevice = "/dev/mem";  // the addresses of the seed's file are its
constexpr std::size_t kLastArea = kMaxAreas - 1;

// In the order of their enumerators.
constexpr std::array<std::string_view, 3> kMismatches = {"Initialise", "Refuse", "Ignore"};
static_assert(std::to_underlying(RetainMismatch::ignore) == 2);
constexpr std::array<std::string_view, 2> kSafeWords = {"Keep", "Zero"};
static_assert(std::to_underlying(SafeState::zero) == 1);

AreaDraft& draft(const SettingsTarget& to, std::size_t number) {
  AreaDraft& area = to.areas[number];
  if (area.where.empty()) area.where = to.where;
  return area;
}

bool set_flags(const SettingsTarget& to, std::size_t number, std::string_view text) {
  const auto flags = integer_of(text);
  if (!flags || *flags < 1 || *flags > PLC_AREA_ALL) return false;
  draft(to, number).flags = flags;
  return true;
}

bool set_address(const SettingsTarget& to, std::size_t number, std::string_view text) {
  const auto address = integer_of(text);
  constexpr std::int64_t kHighest = std::int64_t{1} << 52;
  if (!address || *address < 0 || *address > kHighest) return false;
  if (static_cast<std::uint64_t>(*address) % kAreaAlignment != 0) return false;
  draft(to, number).address = address;
  return true;
}

bool set_size(const SettingsTarget& to, std::size_t number, std::string_view text) {
  const auto size = integer_of(text);
  if (!size || *size < 1 || *size > static_cast<std::int64_t>(kMaxAreaSize)) return false;
  draft(to, number).size = size;
  return true;
}

bool set_device(const SettingsTarget& to, std::size_t number, std::string_view text) {
  if (text.size() > kMaxPath) return false;
  draft(to, number).device = text.starts_with('/') ? std::string(text) : in_folder(to, text);
  return true;
}

bool set_object(const SettingsTarget& to, std::size_t number, std::string_view text) {
  if (!check_name("shared memory", text, kMaxObjectName)) return false;
  draft(to, number).object = text;
  return true;
}

constexpr std::size_t kMaxSafeValues = 4096;

// 0x and two digits for each byte, in the order of their addresses.
std::optional<std::vector<std::byte>> read_hexadecimal(std::string_view text) {
  if (!text.starts_with("0x") && !text.starts_with("0X")) return std::nullopt;
  text.remove_prefix(2);
  if (text.empty() || text.size() % 2 != 0 || text.size() / 2 > kMaxSafeValues) return std::nullopt;
  std::vector<std::byte> bytes;
  for (std::size_t at = 0; at < text.size(); at += 2) {
    const std::string_view digits = text.substr(at, 2);
    std::uint8_t value = 0;
    const auto read = std::from_chars(digits.begin(), digits.end(), value, 16);
    if (read.ec != std::errc() || read.ptr != digits.end()) return std::nullopt;
    bytes.push_back(std::byte{value});
  }
  return bytes;
}

bool set_safe_state(const SettingsTarget& to, std::size_t number, std::string_view text) {
  AreaDraft& area = draft(to, number);
  const auto word =
      std::ranges::find_if(kSafeWords, [&](std::string_view one) { return is_word(text, one); });
  auto bytes = read_hexadecimal(text);
  if (word == kSafeWords.end() && !bytes) return false;
  area.safe = bytes ? SafeState::values : static_cast<SafeState>(word - kSafeWords.begin());
  area.safe_values = std::move(bytes).value_or(std::vector<std::byte>());
  return true;
}

std::unexpected<Error> bad(std::size_t number, const AreaDraft& area, std::string_view what) {
  return failure(ErrorCode::invalid_argument,
                 fmt::format("{}: [SysMem] Area.{}: {}", area.where, number, what));
}

Result<void> check_safe_state(std::size_t number, const AreaDraft& area) {
  if (changes_outputs(area.safe) && (*area.flags & (PLC_AREA_OUTPUT | PLC_AREA_USER)) == 0) {
    return bad(
        number, area,
        fmt::format("has a SafeState, which is for outputs; its Flags {:#x} need 0x8, or bits of {:#x}",
                    *area.flags, PLC_AREA_USER));
  }
  if (area.safe != SafeState::values || static_cast<std::int64_t>(area.safe_values.size()) == *area.size)
    return {};
  return bad(number, area,
             fmt::format("SafeState gives {} bytes, Size is {}; allowed are Keep, Zero, and all {} bytes",
                         area.safe_values.size(), *area.size, *area.size));
}

// The settings of one area must be complete.
Result<AreaSettings> check_area(std::size_t number, const AreaDraft& area) {
  if (!area.flags || !area.size) return bad(number, area, "needs Flags and Size");
  if (!area.device.empty() && !area.object.empty()) {
    return bad(number, area, "has both Device and Object; allowed is one of them");
  }
  if (!area.object.empty() && area.address) {
    return bad(number, area, "has an Address, which a shared memory of the pool (Object) does not need");
  }
  if (area.object.empty() && !area.address) {
    return bad(
        number, area,
        "needs an Address in the device or file (Device, without it /dev/mem), or a shared memory of the "
        "pool (Object)");
  }
  PLCHOST_TRY(check_safe_state(number, area));
  AreaSettings settings{.number = number,
                        .flags = static_cast<std::uint32_t>(*area.flags),
                        .address = static_cast<std::uint64_t>(area.address.value_or(0)),
                        .size = static_cast<std::uint64_t>(*area.size),
                        .device = area.device,
                        .object = area.object,
                        .safe = area.safe,
                        .safe_values = area.safe_values,
                        .where = area.where};
  if (settings.object.empty() && settings.device.empty()) settings.device = kDefaultDevice;
  return settings;
}

bool overlap(const AreaSettings& a, const AreaSettings& b) {
  if (!a.object.empty() || !b.object.empty()) return a.object == b.object;
  return a.device == b.device && a.address < b.address + b.size && b.address < a.address + a.size;
}

template <auto kMember>
using RetainAt = At<&InstanceSettings::retain, kMember>;

constexpr std::array kMemoryKeys = {
    SettingKey{.section = kMemory,
               .name = "Area.N.Flags",
               .prefixed = true,
               .meaning = "areas of the application with these flags lie here; N begins at 0, without a gap",
               .value = NumberedSetting{"1 to 0xFFFF", set_flags, kLastArea}},
    SettingKey{.section = kMemory,
               .name = "Area.N.Address",
               .prefixed = true,
               .meaning = "where it begins in the device or file",
               .value = NumberedSetting{"a multiple of 8 up to 2^52", set_address, kLastArea}},
    SettingKey{.section = kMemory,
               .name = "Area.N.Size",
               .prefixed = true,
               .unit = "bytes",
               .meaning = "size of the memory",
               .value = NumberedSetting{"1 to 0x40000000", set_size, kLastArea}},
    SettingKey{.section = kMemory,
               .name = "Area.N.Device",
               .prefixed = true,
               .meaning = "device (of /dev/uioN its memory 0) or file that it is in",
               .value = NumberedSetting{"/dev/mem (if there is no Object), /dev/uioN or a file", set_device,
                                        kLastArea}},
    SettingKey{.section = kMemory,
               .name = "Area.N.Object",
               .prefixed = true,
               .meaning = "shared memory of the pool that it is",
               .value = NumberedSetting{"name of a shared memory of the pool, 1 to 95 letters, digits, _ - .",
                                        set_object, kLastArea}},
    SettingKey{.section = kMemory,
               .name = "Area.N.SafeState",
               .prefixed = true,
               .meaning = "outputs while no task drives them; without it kept, and terminals go by age",
               .value = NumberedSetting{"Keep, Zero, or 0x and two hexadecimal digits for each of the Size "
                                        "bytes, at most 4096",
                                        set_safe_state, kLastArea}},
    SettingKey{.section = kMemory, .name = "Memlock", .prefixed = true},
    SettingKey{.section = kRetain,
               .name = "Directory",
               .meaning = "where retain values are written; relative to the settings file",
               .value = TextSetting{"a folder, or nothing for the one of --state-directory",
                                    [](std::string_view path) { return path.size() <= kMaxPath; },
                                    [](const SettingsTarget& to, std::string_view path) {
                                      to.settings.retain.directory = path.empty() ? "" : in_folder(to, path);
                                    }}},
    SettingKey{.section = kRetain,
               .name = "IntervalMs",
               .unit = "ms",
               .meaning = "how often retain values that have changed are written",
               .value = number_setting<RetainAt<&RetainSettings::interval>, As<milliseconds>>(10, 3'600'000)},
    SettingKey{
        .section = kRetain,
        .name = "PostponeMs",
        .unit = "ms",
        .meaning =
            "how long a time without any cycle is looked for, before tasks copy their areas themselves",
        .value = number_setting<RetainAt<&RetainSettings::postpone>, As<milliseconds>>(1, 60'000)},
    SettingKey{.section = kRetain,
               .name = "Mismatch",
               .meaning =
                   "retain values of another layout: begin anew, refuse the application, or take areas "
                   "of the same name",
               .value = word_setting<RetainAt<&RetainSettings::mismatch>>(kMismatches)},
};

}  // namespace

std::span<const SettingKey> memory_keys() noexcept {
  return kMemoryKeys;
}

Result<std::vector<AreaSettings>> check_areas(const std::map<std::size_t, AreaDraft>& drafts) {
  std::vector<AreaSettings> areas;
  for (const auto& [number, area] : drafts) {
    if (number != areas.size()) {
      return bad(number, area,
                 fmt::format("there is no Area.{}; areas are numbered 0, 1, 2 without a gap", areas.size()));
    }
    PLCHOST_TRY_ASSIGN(auto checked, check_area(number, area));
    const auto other =
        std::ranges::find_if(areas, [&](const AreaSettings& before) { return overlap(before, checked); });
    if (other != areas.end()) {
      return bad(number, area,
                 fmt::format("overlaps with Area.{} of {}; each needs bytes of its own in {}", other->number,
                             other->where, other->object.empty() ? other->device : other->object));
    }
    areas.push_back(std::move(checked));
  }
  return areas;
}

}  // namespace plchost
