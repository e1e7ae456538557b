#include "instances/runtime/settings/settings_key.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::array<std::string_view, 2> kPlatforms = {"Linux.", "VxWorks."};

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};

std::optional<std::int64_t> integer(std::string_view text, int base = 10) {
  std::int64_t number = 0;
  const char* const end = text.data() + text.size();
  // NOLINTNEXTLINE(bugprone-suspicious-stringview-data-usage): `end` is the size
  const auto [stop, error] = std::from_chars(text.data(), end, number, base);
  if (error != std::errc() || stop != end) return std::nullopt;
  return number;
}

// Of an IEC literal: a single underscore may stand between two digits.
std::optional<std::int64_t> iec_digits(std::string_view text, int base) {
  if (text.starts_with('_') || text.ends_with('_') || text.find("__") != std::string_view::npos) {
    return std::nullopt;
  }
  std::string digits(text);
  std::erase(digits, '_');
  return integer(digits, base);
}

// "976.5625", rounded to nanoseconds.
std::optional<Duration> decimal_microseconds(std::string_view text) {
  const std::size_t point = text.find('.');
  const auto whole = point == std::string_view::npos ? integer_of(text) : integer(text.substr(0, point));
  constexpr std::int64_t kLargest = 1'000'000'000'000;
  if (!whole || *whole < 0 || *whole > kLargest || text.front() == '-') return std::nullopt;
  if (point == std::string_view::npos) return Duration(*whole * 1000);
  constexpr std::size_t kDecimals = 4;
  std::string decimals(text.substr(point + 1));
  if (decimals.empty() || decimals.size() > kDecimals || decimals.front() == '-') return std::nullopt;
  decimals.resize(kDecimals, '0');
  const auto fraction = integer(decimals);
  if (!fraction) return std::nullopt;
  return Duration(*whole * 1000 + (*fraction + 5) / 10);
}

bool is_numbered(const SettingKey& key) {
  return std::holds_alternative<NumberedSetting>(key.value);
}

std::string_view without_platform(std::string_view name) {
  for (const std::string_view platform : kPlatforms) {
    if (name.starts_with(platform)) return name.substr(platform.size());
  }
  return name;
}

// The part to compare with the name in the table; nothing: it lacks the platform in front.
std::optional<std::string_view> plain_name(const SettingKey& key, std::string_view name) {
  if (!key.prefixed) return name;
  const std::string_view plain = without_platform(name);
  return plain.size() == name.size() ? std::nullopt : std::optional(plain);
}

// The number of "Component.7" for the row "Component.N", of "Area.3.Size" for "Area.N.Size".
std::optional<std::size_t> number_of(const SettingKey& key, std::string_view name) {
  const auto plain = plain_name(key, name);
  if (!plain || !is_numbered(key)) return std::nullopt;
  const std::size_t at = key.name.find(".N") + 1;
  const std::string_view behind = key.name.substr(at + 1);
  if (plain->size() <= at + behind.size() || !plain->starts_with(key.name.substr(0, at)) ||
      !plain->ends_with(behind)) {
    return std::nullopt;
  }
  const std::string_view digits = plain->substr(at, plain->size() - at - behind.size());
  const auto number = digits.front() == '-' ? std::nullopt : integer(digits);
  const auto highest = static_cast<std::int64_t>(std::get<NumberedSetting>(key.value).highest);
  if (!number || *number > highest) return std::nullopt;
  return static_cast<std::size_t>(*number);
}

// The writer's name of "Parameter.speed" for the row "Parameter.NAME".
std::optional<std::string_view> own_part(const SettingKey& key, std::string_view name) {
  constexpr std::string_view kName = "NAME";
  if (!std::holds_alternative<NamedSetting>(key.value)) return std::nullopt;
  const std::string_view stem = key.name.substr(0, key.name.size() - kName.size());
  if (!name.starts_with(stem)) return std::nullopt;
  const std::string_view part = name.substr(stem.size());
  return check_name("parameter", part, kMaxParameterName) ? std::optional(part) : std::nullopt;
}

bool is_named(const SettingKey& key, std::string_view name) {
  if (std::holds_alternative<NamedSetting>(key.value)) return own_part(key, name).has_value();
  if (is_numbered(key)) return number_of(key, name).has_value();
  return plain_name(key, name) == key.name;
}

std::string lower(std::string_view text) {
  std::string lowered(text);
  for (char& c : lowered) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lowered;
}

const std::vector<std::string_view>& all_sections() {
  static const std::vector<std::string_view> all = [] {
    std::vector<std::string_view> sections;
    for (const SettingKey& key : all_setting_keys()) {
      if (std::ranges::find(sections, key.section) == sections.end()) sections.push_back(key.section);
    }
    return sections;
  }();
  return all;
}

std::unexpected<Error> unknown_key(std::string_view section, std::string_view name) {
  std::vector<std::string_view> names;
  std::vector<std::string> allowed;
  for (const SettingKey& key : all_setting_keys()) {
    if (key.section != table_section(section) || std::holds_alternative<UnusedSetting>(key.value)) continue;
    names.push_back(key.name);
    const auto* const numbered = std::get_if<NumberedSetting>(&key.value);
    allowed.push_back(written_name(key) +
                      (numbered != nullptr ? fmt::format(" (N 0 to {})", numbered->highest) : ""));
  }
  const std::string_view nearest = nearest_name(without_platform(shown(name)), names);
  const auto meant = std::ranges::find(names, nearest) - names.begin();
  return failure(ErrorCode::invalid_argument,
                 fmt::format("[{}] has no key '{}'{}; allowed are {}", shown(section), shown(name),
                             nearest.empty() ? ""
                                             : fmt::format(", did you mean '{}'?",
                                                           allowed[static_cast<std::size_t>(meant)]),
                             fmt::join(allowed, ", ")));
}

}  // namespace

std::optional<std::int64_t> integer_of(std::string_view text) {
  using Base = std::pair<std::string_view, int>;
  constexpr std::array<Base, 5> kBases = {Base("0x", 16), {"0X", 16}, {"16#", 16}, {"8#", 8}, {"2#", 2}};
  for (const auto& [prefix, base] : kBases) {
    if (!text.starts_with(prefix)) continue;
    const std::string_view digits = text.substr(prefix.size());
    if (digits.starts_with('-')) return std::nullopt;
    return prefix.ends_with('#') ? iec_digits(digits, base) : integer(digits, base);
  }
  return integer(text);
}

std::string in_folder(const SettingsTarget& target, std::string_view path) {
  if (target.folder.empty()) return std::string(path);
  return (std::filesystem::path(target.folder) / path).lexically_normal();
}

const std::vector<SettingKey>& all_setting_keys() {
  static const std::vector<SettingKey> all = [] {
    std::vector<SettingKey> keys;
    for (const auto table : {schedule_keys(), timer_keys(), clock_keys(), block_keys(), task_keys(),
                             component_keys(), application_keys(), memory_keys(), sandbox_keys()}) {
      keys.insert(keys.end(), table.begin(), table.end());
    }
    return keys;
  }();
  return all;
}

std::string_view table_section(std::string_view section) noexcept {
  return section.starts_with(kTaskPrefix) ? kTaskSections : section;
}

bool is_owned(std::string_view section) {
  return std::ranges::find(all_sections(), table_section(section)) != all_sections().end();
}

std::string_view meant_section(std::string_view section) {
  const std::string written = lower(shown(section));
  for (const std::string_view known : all_sections()) {
    const bool task = known == kTaskSections;
    const std::string stem = lower(task ? kTaskPrefix : known);
    const std::string_view begin =
        task ? std::string_view(written).substr(0, written.find('.') + 1) : std::string_view(written);
    // Names of other programs' sections are near to ours ([SysFile], [SysTimeRtc]): one error in five
    // characters is a typing error, more is another name.
    constexpr std::size_t kCharacters = 5;
    const std::array<std::string_view, 1> only = {stem};
    if (!nearest_name(begin, only, stem.size() / kCharacters).empty()) return known;
  }
  return {};
}

std::string written_name(const SettingKey& key) {
  return fmt::format("{}{}", key.prefixed ? kPlatforms.front() : "", key.name);
}

std::string allowed_values(const SettingKey& key) {
  const std::string range = std::visit(
      Overloaded{
          [](const NumberSetting& number) {
            return fmt::format("{} to {}{}", number.lowest, number.highest,
                               number.capped ? fmt::format(", more acts as {}", number.highest) : "");
          },
          [](const OptionalNumberSetting& number) {
            return fmt::format("1 to {}, or 0 or -1 (not set)", number.highest);
          },
          [](const MicrosecondSetting& us) {
            return fmt::format("{} to {} with up to four decimals", us.lowest, us.highest);
          },
          [](const WordSetting& word) { return join_names(word.words); },
          [](const TextSetting& text) { return std::string(text.form); },
          [](const NumberedSetting& numbered) {
            return fmt::format("{}, N 0 to {}", numbered.form, numbered.highest);
          },
          [](const NamedSetting& named) {
            return fmt::format("{}; NAME: 1 to {} letters, digits, _ - .", named.form, kMaxParameterName);
          },
          [](const UnusedSetting&) { return std::string(); },
      },
      key.value);
  return key.unit.empty() ? range : fmt::format("{}, {}", key.unit, range);
}

std::string initial_value(const SettingKey& key) {
  return std::visit(
      Overloaded{
          [](const NumberSetting& setting) {
            const std::int64_t number = setting.initial();
            return number < setting.lowest ? std::string() : fmt::format("{}", number);
          },
          [](const OptionalNumberSetting& setting) {
            const std::int64_t number = setting.initial();
            return fmt::format("{}", number == 0 ? -1 : number);
          },
          [](const MicrosecondSetting& setting) {
            return fmt::format("{}", setting.initial() / std::chrono::microseconds(1));
          },
          [](const WordSetting& setting) { return std::string(setting.words[setting.initial()]); },
          [](const TextSetting& setting) {
            return setting.initial == nullptr ? std::string() : setting.initial();
          },
          [](const auto& /*none*/) { return std::string(); },
      },
      key.value);
}

bool is_word(std::string_view text, std::string_view word) {
  return lower(text) == lower(word);
}

Result<const SettingKey*> find_setting(std::string_view section, std::string_view name) {
  const auto found = std::ranges::find_if(all_setting_keys(), [&](const SettingKey& key) {
    return key.section == table_section(section) && is_named(key, name);
  });
  if (found == all_setting_keys().end()) return unknown_key(section, name);
  return &*found;
}

std::string setting_identity(const SettingKey& key, std::string_view name) {
  if (own_part(key, name)) return std::string(name);
  const auto number = number_of(key, name);
  return number ? fmt::format("{}{}", key.name, *number) : std::string(key.name);
}

Result<std::string> apply_setting(const SettingKey& key, std::string_view name, std::string_view value,
                                  const SettingsTarget& target) {
  const auto number = integer_of(value);
  std::string remark;
  const bool applied = std::visit(
      Overloaded{
          [&](const NumberSetting& setting) {
            if (!number || *number < setting.lowest) return false;
            const bool above = *number > setting.highest;
            if (above && !setting.capped) return false;
            if (above) remark = fmt::format("{} acts as {}", *number, setting.highest);
            setting.apply(target, std::min(*number, setting.highest));
            return true;
          },
          [&](const OptionalNumberSetting& setting) {
            if (!number || *number < -1 || *number > setting.highest) return false;
            setting.apply(target, *number);
            return true;
          },
          [&](const MicrosecondSetting& setting) {
            const auto us = decimal_microseconds(value);
            using std::chrono::microseconds;
            if (!us || *us < microseconds(setting.lowest) || *us > microseconds(setting.highest))
              return false;
            setting.apply(target, *us);
            return true;
          },
          [&](const WordSetting& setting) {
            const auto word = std::ranges::find(setting.words, lower(value), lower);
            if (word == setting.words.end()) return false;
            setting.apply(target, static_cast<std::size_t>(word - setting.words.begin()));
            return true;
          },
          [&](const TextSetting& setting) {
            if (!setting.allows(value)) return false;
            setting.apply(target, value);
            return true;
          },
          [&](const NumberedSetting& setting) {
            return !value.empty() && setting.apply(target, number_of(key, name).value_or(0), value);
          },
          [&](const NamedSetting& setting) {
            return setting.apply(target, own_part(key, name).value_or(std::string_view()), value);
          },
          [](const UnusedSetting&) { return true; },
      },
      key.value);
  if (applied) return remark;
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is not allowed; allowed is: {}", shown(value), allowed_values(key)));
}

}  // namespace plchost
