#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "shm/toml/section_reader.hpp"

// Tables of the keys of a file: one row for each. Reading with its range and errors, comparison and
// documentation come from the row.

namespace plchost {

/// One row. Key describes the key for people; it has at least `section`, `name`, `initial` and `meaning`.
/// Config is the struct of the section; Reading is all that the kinds of value need beside the file.
template <class Key, class Config, class Reading>
struct KeyRow {
  Key key;
  /// Checks the value and writes it; the default is checked, too. Errors go to the reader.
  void (*read)(const Reading& reading, SectionReader& reader, std::string_view name, Config& target);
  bool (*differs)(const Config& before, const Config& now);
  void (*take)(Config& used, const Config& now);
  std::string (*allowed)();  ///< "1 to 1024"
  std::string (*initial)();  ///< that of the struct; empty: none
};

/// Makes the row of one member.
template <auto Member>
struct KeyAccess;

template <class Config, class Value, Value Config::* Member>
struct KeyAccess<Member> {
  static bool differs(const Config& before, const Config& now) { return !(before.*Member == now.*Member); }
  static void take(Config& used, const Config& now) { used.*Member = now.*Member; }
  template <class Kind, class Reading>
  static void read(const Reading& reading, SectionReader& reader, std::string_view name, Config& target) {
    Kind::read(reading, reader, name, target.*Member);
  }
  template <class Kind>
  static std::string initial() {
    return Kind::shown(Config{}.*Member);
  }
  template <class Kind, class Reading, class Key>
  static constexpr KeyRow<Key, Config, Reading> row(std::string_view section, Key key) {
    key.section = section;
    return {.key = key,
            .read = &KeyAccess::read<Kind, Reading>,
            .differs = &KeyAccess::differs,
            .take = &KeyAccess::take,
            .allowed = &Kind::allowed,
            .initial = &KeyAccess::initial<Kind>};
  }
};

/// Stands for any member of an aggregate, to count them.
struct AnyMember {
  template <class Member>
  operator Member() const;  // NOLINT: implicit on purpose, and never defined
};

/// The members of an aggregate: a table has a row for each.
template <class Config, class... Members>
consteval std::size_t count_members() {
  if constexpr (requires { Config{Members{}..., AnyMember{}}; }) {
    return count_members<Config, Members..., AnyMember>();
  } else {
    return sizeof...(Members);
  }
}

/// Reads the keys of these rows.
template <class Key, class Config, class Reading>
void read_rows(std::span<const KeyRow<Key, Config, Reading>> rows, const Reading& reading,
               SectionReader& reader, Config& target) {
  for (const auto& row : rows) row.read(reading, reader, row.key.name, target);
}

/// Reads all keys of a section, and refuses those that no row has.
template <class Key, class Config, class Reading>
void read_keys(std::span<const KeyRow<Key, Config, Reading>> rows, const Reading& reading,
               SectionReader& reader, Config& target) {
  read_rows(rows, reading, reader, target);
  reader.refuse_unknown_keys();
}

inline constexpr std::string_view kKeyTableHead =
    "| key | meaning | allowed | default |\n| --- | --- | --- | --- |\n";

/// Adds the rows of one section to the table of a document, a line with its end for each.
template <class Rows>
void add_section(const Rows& rows, std::string& table) {
  bool first = true;
  for (const auto& row : rows) {
    const std::string section = std::exchange(first, false) ? fmt::format("**{}** ", row.key.section) : "";
    const std::string initial = row.key.initial.empty() ? row.initial() : std::string(row.key.initial);
    table += fmt::format("| {}`{}` | {} | {} | {} |\n", section, row.key.name, row.key.meaning, row.allowed(),
                         initial.empty() ? "none" : initial);
  }
}

}  // namespace plchost
