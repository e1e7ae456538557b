#pragma once

#include <cstdint>
#include <expected>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace plchost {

struct TomlValue;
using TomlArray = std::vector<TomlValue>;
using TomlTable = std::map<std::string, TomlValue, std::less<>>;

/// A value of a TOML file, with the place of its key. Keeps the parser out of everybody else's headers.
struct TomlValue {
  /// monostate: a date or time, which no key of ours has.
  std::variant<std::monostate, std::string, std::int64_t, double, bool, TomlArray, TomlTable> value;
  unsigned line = 0;
  unsigned column = 0;

  /// "a text", "a whole number", ...: for messages.
  [[nodiscard]] std::string_view type_name() const noexcept;
  /// The value as it could stand in the file, shortened; tables and arrays by their type.
  [[nodiscard]] std::string shown() const;
};

/// Something wrong in a file, and where.
struct ConfigProblem {
  unsigned line = 0;  ///< 0: the file as a whole
  std::string text;
  unsigned column = 0;  ///< 0: the line as a whole
};

/// "FILE:LINE:COLUMN: TEXT", as far as they are known.
[[nodiscard]] std::string describe(const std::string& file, const ConfigProblem& problem);

/// Any text, hostile ones included: never throws, bounded depth.
[[nodiscard]] std::expected<TomlTable, ConfigProblem> parse_toml(std::string_view text);

}  // namespace plchost
