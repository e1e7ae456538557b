#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "instances/runtime/settings/settings.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// An Area.N as far as it was read: nothing is what was not said.
struct AreaDraft {
  std::string where;  ///< its first line
  std::optional<std::int64_t> flags, address, size;
  std::string device, object;
  SafeState safe = SafeState::unsaid;
  std::vector<std::byte> safe_values;
};

/// The targets of a row of the table.
struct SettingsTarget {
  InstanceSettings& settings;
  std::map<std::size_t, std::string>& components;  ///< by their number, foreign ones too
  std::map<std::size_t, AreaDraft>& areas;         ///< by their number
  std::string_view where;                          ///< "line1.cfg:12"
  TaskSettings* task;                              ///< of the section [Task.NAME]; null in other sections
  std::string_view folder;                         ///< of the file; empty: relative paths stay as they are
};

/// The path, as it counts from the folder of its file.
[[nodiscard]] std::string in_folder(const SettingsTarget& target, std::string_view path);

// The kinds of value of a key. Each has its range, where a value goes, and the default as it stands in the
// program; null: there is none. Both functions are made by setting_places.hpp from a member of the settings.

/// An integer, lowest to highest. A default outside of the range is none that could be written.
struct NumberSetting {
  std::int64_t lowest;
  std::int64_t highest;
  void (*apply)(const SettingsTarget&, std::int64_t number);
  std::int64_t (*initial)();
  bool capped = false;  ///< more acts as highest, with a remark: files of the other runtime have it
};

/// 0 or -1 for "not set", or an integer of 1 to highest.
struct OptionalNumberSetting {
  std::int64_t highest;
  void (*apply)(const SettingsTarget&, std::int64_t number);
  std::int64_t (*initial)();
};

/// Microseconds with up to four decimals, so that 1024 Hz can be written: lowest to highest.
struct MicrosecondSetting {
  std::int64_t lowest;
  std::int64_t highest;
  void (*apply)(const SettingsTarget&, Duration value);
  Duration (*initial)();
};

/// One of these words, in any case.
struct WordSetting {
  std::span<const std::string_view> words;
  void (*apply)(const SettingsTarget&, std::size_t index);
  std::size_t (*initial)();
};

/// A text.
struct TextSetting {
  std::string_view form;  ///< the allowed values, in words
  bool (*allows)(std::string_view text);
  void (*apply)(const SettingsTarget&, std::string_view text);
  std::string (*initial)() = nullptr;
};

/// A key with ".N" at its end, or ".N." in it: N is 0 to highest. Its name in the table has it, too.
struct NumberedSetting {
  std::string_view form;
  bool (*apply)(const SettingsTarget&, std::size_t number, std::string_view text);  ///< false: not allowed
  std::size_t highest = kMaxComponents;
};

/// A key with ".NAME" at its end: NAME is the writer's own. Its name in the table has it, too.
struct NamedSetting {
  std::string_view form;
  bool (*apply)(const SettingsTarget&, std::string_view name, std::string_view text);  ///< false: not allowed
};

/// Documented for CODESYS, without a meaning here: accepted with a remark.
struct UnusedSetting {};

/// One row of the table of keys. Parsing, errors, lists of what is allowed and the table of
/// instances/settings.md come from it.
struct SettingKey {
  std::string_view section;  ///< kTaskSections: any [Task.NAME]
  std::string_view name;
  bool prefixed = false;       ///< written with the name of a platform in front: VxWorks.NAME, or Linux.NAME
  std::string_view unit{};     ///< empty: none
  std::string_view meaning{};  ///< for the table in instances/settings.md
  std::variant<NumberSetting, OptionalNumberSetting, MicrosecondSetting, WordSetting, TextSetting,
               NumberedSetting, NamedSetting, UnusedSetting>
      value = UnusedSetting{};
};

inline constexpr std::string_view kTaskSections = "Task.NAME";
inline constexpr std::string_view kTaskPrefix = "Task.";  ///< the beginning of its name

// The tables, one for each file settings_*.cpp. A new one is added to all_setting_keys().
[[nodiscard]] std::span<const SettingKey> schedule_keys() noexcept;
[[nodiscard]] std::span<const SettingKey> timer_keys() noexcept;
[[nodiscard]] std::span<const SettingKey> clock_keys() noexcept;
[[nodiscard]] std::span<const SettingKey> block_keys() noexcept;
[[nodiscard]] std::span<const SettingKey> task_keys() noexcept;
[[nodiscard]] std::span<const SettingKey> component_keys() noexcept;
[[nodiscard]] std::span<const SettingKey> application_keys() noexcept;
[[nodiscard]] std::span<const SettingKey> memory_keys() noexcept;
[[nodiscard]] std::span<const SettingKey> sandbox_keys() noexcept;

/// The settings of all areas, checked as a whole. The error names the line of the area.
[[nodiscard]] Result<std::vector<AreaSettings>> check_areas(const std::map<std::size_t, AreaDraft>& drafts);

/// All rows, in the order of the table in instances/settings.md.
[[nodiscard]] const std::vector<SettingKey>& all_setting_keys();

/// The key of the table for a section as written: kTaskSections for "Task.Fast".
[[nodiscard]] std::string_view table_section(std::string_view section) noexcept;
[[nodiscard]] bool is_owned(std::string_view section);
/// The section of the table that a section as written was meant to be: in another case, or with a typing
/// error. Empty: it is another program's.
[[nodiscard]] std::string_view meant_section(std::string_view section);

/// In any case.
[[nodiscard]] bool is_word(std::string_view text, std::string_view word);

/// "1000", "0x3E8", or a literal of IEC 61131-3: "16#3E8", "8#17", "2#1111_0000". Nothing: no number.
[[nodiscard]] std::optional<std::int64_t> integer_of(std::string_view text);

/// "VxWorks.TimerSource"
[[nodiscard]] std::string written_name(const SettingKey& key);
/// "us, 50 to 1000000"
[[nodiscard]] std::string allowed_values(const SettingKey& key);
/// The default, as it would be written: "1000"; empty: there is none.
[[nodiscard]] std::string initial_value(const SettingKey& key);

/// The row for a key as written in an owned section. invalid_argument: there is none; the text lists what
/// there is, and what may have been meant.
[[nodiscard]] Result<const SettingKey*> find_setting(std::string_view section, std::string_view name);

/// The same for all ways to write one key: "TimerSource", "Component.1".
[[nodiscard]] std::string setting_identity(const SettingKey& key, std::string_view name);

/// The component is built into another runtime: a name and no file.
[[nodiscard]] bool is_foreign_component(std::string_view component);

/// Checks the value and writes it. The text is a remark about it, mostly empty. invalid_argument: the text
/// says what is allowed.
[[nodiscard]] Result<std::string> apply_setting(const SettingKey& key, std::string_view name,
                                                std::string_view value, const SettingsTarget& target);

}  // namespace plchost
