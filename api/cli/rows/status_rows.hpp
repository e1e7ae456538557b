#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <deque>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <status_fields.hpp>

#include "api/cli/rows/computed_fields.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/dds/sequence.hpp"

namespace plchost {

namespace status_rows {

template <class Value>
void add(Row& row, const dds::FieldInfo& field, const Value& value) {
  const std::string name =
      field.unit == dds::Unit::duration ? fmt::format("{}_us", field.base) : std::string(field.row);
  if constexpr (std::same_as<Value, Row> || std::same_as<Value, bool>) {
    row[name] = value;
  } else if constexpr (std::integral<Value>) {
    if (std::cmp_equal(value, field.null)) {
      row[name] = nullptr;
    } else if (!field.words.empty()) {
      row[name] = dds::word_for(field.words, static_cast<std::uint64_t>(value));
    } else if (field.unit == dds::Unit::duration) {
      row[name] = to_us(static_cast<std::int64_t>(value));
    } else if (field.unit == dds::Unit::unix) {
      row[std::string(field.base)] = time_text(static_cast<std::int64_t>(value));
      row[name] = value;
    } else if (field.unit == dds::Unit::unix_text) {
      row[std::string(field.base)] = time_text(static_cast<std::int64_t>(value));
    } else {
      row[name] = value;
    }
  } else if constexpr (std::convertible_to<Value, std::string_view>) {
    const std::string_view text(value);
    row[name] = text.empty() && field.null_if_empty ? Row() : Row(text);
  } else {
    const bool of_all = std::ranges::all_of(value, [](auto octet) { return octet == 0; });
    row[name] = of_all ? "all" : fmt::format("{:02x}", fmt::join(value, ""));
  }
}

}  // namespace status_rows

/// The row of a topic, as control.idl has it; its field names are a promise to programs. Each field is in its
/// order: durations in us, times as a text and as a number, codes as words, GUIDs as digits ("all": of
/// zeros). Then come the entries of `ext`, if there are any. Computed fields come from computed_of(sample,
/// context...).
template <class Sample, class... Context>
  requires dds::kHasRow<Sample>
[[nodiscard]] Row to_row(const Sample& sample, const Context&... context) {
  const auto computed = [&]() -> dds::Computed<Sample, Row> {
    if constexpr (std::is_empty_v<dds::Computed<Sample, Row>>) {
      return {};
    } else {
      return computed_of(sample, context...);
    }
  }();
  Row row;
  dds::visit_row(sample, computed, [&](const dds::FieldInfo& field, const auto& value) {
    status_rows::add(row, field, value);
  });
  if constexpr (requires { sample.ext; }) add_extension(row, dds::parts_of(sample.ext));
  return row;
}

/// The columns that control.idl names; else all members: where there is no room, the last ones go first, and
/// keys never.
template <class Sample>
[[nodiscard]] const std::vector<Column>& columns_of() {
  static const auto made = [] {
    std::vector<Column> columns;
    for (const dds::ColumnInfo& told : dds::kColumns<Sample>) {
      columns.push_back({.field = told.field,
                         .header = told.header,
                         .decimals = told.decimals,
                         .rank = told.rank,
                         .none = told.none});
    }
    if (!columns.empty()) return columns;
    static std::deque<std::string> texts;  // a Column names them
    const dds::Computed<Sample, Row> computed;
    dds::visit_row(Sample{}, computed, [&](const dds::FieldInfo& field, const auto& /*value*/) {
      const bool duration = field.unit == dds::Unit::duration;
      const std::string& name =
          texts.emplace_back(duration ? fmt::format("{}_us", field.base) : std::string(field.base));
      std::string header(field.base);
      std::ranges::transform(header, header.begin(), [](char c) {
        return c == '_' ? '-' : static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
      });
      const std::string& shown = texts.emplace_back(duration ? header + "(us)" : header);
      const int rank = field.name == "host" ? 1 : field.key ? 0 : static_cast<int>(columns.size()) + 1;
      columns.push_back({.field = name.c_str(), .header = shown.c_str(), .rank = rank});
    });
    return columns;
  }();
  return made;
}

}  // namespace plchost
