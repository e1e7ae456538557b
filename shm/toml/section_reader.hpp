#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/toml/toml_document.hpp"

namespace plchost {

/// Reads one table of the file key by key. An error goes to `problems`, with line, key, value and the allowed
/// values, and leaves the target as it was. Reading goes on, so that one run shows all errors.
class SectionReader {
 public:
  /// `where` is how messages call the table: "[host]" or "[[instance]] 'line1'".
  SectionReader(const TomlTable& table, unsigned line, std::string where,
                std::vector<ConfigProblem>& problems)
      : table_(table), line_(line), where_(std::move(where)), problems_(problems) {}

  void text(std::string_view key, std::string& target);
  void truth(std::string_view key, bool& target);
  void number(std::string_view key, std::int64_t least, std::int64_t most, std::int64_t& target);
  void choice(std::string_view key, std::span<const std::string_view> allowed, std::string& target);
  void texts(std::string_view key, std::size_t most, std::vector<std::string>& target);
  /// Nothing is left in `target` if the key is not there.
  void numbers(std::string_view key, std::int64_t least, std::int64_t most,
               std::optional<std::vector<int>>& target);

  /// From here on problems have columns, too.
  void tell_columns() { columns_ = true; }
  /// A key that is read by somebody else.
  void know(std::string_view key) { known_.push_back(key); }
  /// After all keys: reports those that nobody asked for.
  void refuse_unknown_keys();

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  /// It is there and a text.
  [[nodiscard]] bool has_text(std::string_view key) const;
  /// Something wrong with its value was reported.
  [[nodiscard]] bool wrong(std::string_view key) const;
  /// Line of the key if it is there, else of the table.
  [[nodiscard]] unsigned line_of(std::string_view key) const;
  /// Reports something wrong with the value of `key`.
  void problem(std::string_view key, std::string_view text);

 private:
  const TomlValue* find(std::string_view key);
  void wrong_type(std::string_view key, const TomlValue& value, std::string_view wanted);
  [[nodiscard]] unsigned column_of(const TomlValue& value) const { return columns_ ? value.column : 0; }

  const TomlTable& table_;
  unsigned line_;
  std::string where_;
  bool columns_ = false;
  std::vector<ConfigProblem>& problems_;
  std::vector<std::string_view> known_;
  std::vector<std::string> wrong_;
};

/// "; did you mean 'x'?" or nothing.
[[nodiscard]] std::string suggestion(std::string_view unknown, std::span<const std::string_view> known);

}  // namespace plchost
