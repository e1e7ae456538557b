#include "api/cli/rows/table.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "api/recording/csv_text.hpp"
#include "shm/base/names.hpp"
#include "shm/base/utf8.hpp"

namespace plchost {

namespace {

std::string cell_of(const Row& row, const Column& column) {
  const auto found = row.find(column.field);
  if (found == row.end() || found->is_null()) return "-";
  if (found->is_number_integer() && found->get<std::int64_t>() == column.none) return "-";
  if (found->is_string()) {
    auto text = printable(found->get<std::string>());
    return text.empty() ? "-" : text;
  }
  if (found->is_number_float()) {
    const std::string text = fmt::format("{:.{}f}", found->get<double>(), column.decimals);
    return text == "-0" ? "0" : text;
  }
  if (found->is_boolean()) return found->get<bool>() ? "yes" : "no";
  return found->dump();
}

bool is_number(const std::vector<Row>& rows, const char* field) {
  return std::ranges::any_of(rows, [&](const Row& row) {
    const auto found = row.find(field);
    return found != row.end() && found->is_number();
  });
}

// In characters of UTF-8, which is what a terminal puts side by side.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return !continues_utf8(c); }));
}

/// The colour of a state, as terminals number them; 0: that of all other text.
int colour_of(std::string_view field, std::string_view text) {
  constexpr int kRed = 31;
  constexpr int kGreen = 32;
  constexpr int kYellow = 33;
  if (field != "state" && field != "to") return 0;
  switch (health_of(text)) {
    case StateHealth::none:
      return 0;
    case StateHealth::well:
      return kGreen;
    case StateHealth::uncertain:
      return kYellow;
    case StateHealth::bad:
      return kRed;
  }
  return 0;
}

std::string coloured_cell(std::string_view field, std::string text) {
  const int colour = colour_of(field, text);
  return colour == 0 ? text : fmt::format("\x1b[{}m{}\x1b[0m", colour, text);
}

/// A column as it stands in the table.
struct PrintedColumn {
  Column column;
  std::vector<std::string> cells;  ///< the header first
  std::size_t width = 0;
  bool right = false;
};

PrintedColumn print_column(const std::vector<Row>& rows, const Column& column) {
  PrintedColumn printed{.column = column, .cells = {column.header}, .width = 0, .right = false};
  for (const Row& row : rows) printed.cells.push_back(cell_of(row, column));
  printed.width = width_of(std::ranges::max(printed.cells, {}, width_of));
  printed.right = is_number(rows, column.field);
  return printed;
}

std::size_t width_of_all(const std::vector<PrintedColumn>& columns) {
  std::size_t width = 0;
  for (const PrintedColumn& one : columns) width += one.width + (width > 0 ? 2 : 0);
  return width;
}

// Columns of the greatest rank go first, the right one of equals. The rest may still be too wide.
void fit(std::vector<PrintedColumn>& columns, std::size_t width) {
  while (width_of_all(columns) > width) {
    auto least = columns.end();
    for (auto at = columns.begin(); at != columns.end(); ++at) {
      if (at->column.rank > 0 && (least == columns.end() || at->column.rank >= least->column.rank))
        least = at;
    }
    if (least == columns.end()) return;
    columns.erase(least);
  }
}

// The rows' own names come first; they live as long as the rows.
std::vector<std::string_view> fields_of(const std::vector<Row>& rows, const std::vector<Column>& columns) {
  std::vector<std::string_view> fields;
  if (!rows.empty()) {
    for (const auto& [field, value] : rows.front().items()) fields.push_back(field);
  }
  for (const Column& column : columns) {
    if (std::ranges::find(fields, column.field) == fields.end()) fields.emplace_back(column.field);
  }
  return fields;
}

std::unexpected<Error> unknown_field(std::string_view field, const std::vector<std::string_view>& all) {
  return failure(ErrorCode::invalid_argument,
                 fmt::format("there is no column '{}'; there are {}", shown(field), join_names(all)));
}

std::string csv_field(const Row& value) {
  if (value.is_null()) return "";
  const std::string text = value.is_string() ? printable(value.get<std::string>())
                                             : value.dump(-1, ' ', false, Row::error_handler_t::replace);
  return csv_cell(text);
}

}  // namespace

StateHealth health_of(std::string_view state) noexcept {
  if (state == "running" || state == "alive") return StateHealth::well;
  if (state == "exception" || state == "failed" || state == "silent") return StateHealth::bad;
  if (state == "safe_mode" || state == "waiting" || state == "starting" || state == "stopping")
    return StateHealth::uncertain;
  return StateHealth::none;
}

std::vector<std::string> table_lines(const std::vector<Row>& rows, const std::vector<Column>& columns,
                                     const TableStyle& style) {
  std::vector<PrintedColumn> printed;
  for (const Column& column : columns) printed.push_back(print_column(rows, column));
  if (style.width > 0) fit(printed, style.width);
  std::vector<std::string> lines(rows.size() + 1);
  for (const PrintedColumn& one : printed) {
    const bool last = &one == &printed.back();
    for (std::size_t i = 0; i < one.cells.size(); ++i) {
      const std::string padding(one.width - width_of(one.cells[i]), ' ');
      if (one.right) lines[i] += padding;
      lines[i] += style.coloured && i > 0 ? coloured_cell(one.column.field, one.cells[i]) : one.cells[i];
      if (!one.right && !last) lines[i] += padding;
      if (!last) lines[i] += "  ";
    }
  }
  return lines;
}

std::string format_table(const std::vector<Row>& rows, const std::vector<Column>& columns,
                         const TableStyle& style) {
  std::string text;
  for (const std::string& line : table_lines(rows, columns, style)) text += line + "\n";
  return text;
}

Result<std::vector<Column>> choose_columns(const std::vector<std::string>& fields,
                                           const std::vector<Row>& rows, const std::vector<Column>& columns) {
  const auto all = fields_of(rows, columns);
  std::vector<Column> chosen;
  for (const std::string& field : fields) {
    const auto known = std::ranges::find(columns, field, &Column::field);
    if (known != columns.end()) {
      chosen.push_back(*known);
      chosen.back().rank = 0;
      continue;
    }
    if (rows.empty() || !rows.front().contains(field)) return unknown_field(field, all);
    const char* const of_rows = rows.front().find(field).key().c_str();
    chosen.push_back({.field = of_rows, .header = of_rows, .decimals = 3});
  }
  return chosen;
}

Result<void> sort_rows(std::vector<Row>& rows, std::string_view field) {
  const bool down = field.starts_with('-');
  if (down) field.remove_prefix(1);
  const auto all = fields_of(rows, {});
  if (!rows.empty() && std::ranges::find(all, field) == all.end()) return unknown_field(field, all);
  const std::string name(field);
  const auto before = [&](const Row& left, const Row& right) {
    const Row& a = left.contains(name) ? left.at(name) : Row();
    const Row& b = right.contains(name) ? right.at(name) : Row();
    return down ? b < a : a < b;
  };
  std::ranges::stable_sort(rows, before);
  return {};
}

std::string format_fields(const Row& row) {
  std::size_t width = 0;
  for (const auto& [field, value] : row.items()) width = std::max(width, field.size());
  std::string text;
  for (const auto& [field, value] : row.items()) {
    text += fmt::format("{:<{}}  {}\n", printable(field), width,
                        cell_of(row, {.field = field.c_str(), .header = "", .decimals = 3}));
  }
  return text;
}

std::string json_text(const Row& row) {
  const std::string text = row.dump(-1, ' ', false, Row::error_handler_t::replace);
  std::string escaped;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto code = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
    const bool above_ascii = code(i) == 0xc2 && i + 1 < text.size() && code(i + 1) < 0xa0;
    if (above_ascii) ++i;
    if (above_ascii || code(i) == 0x7f) {
      escaped += fmt::format("\\u{:04x}", code(i));
    } else {
      escaped += text[i];
    }
  }
  return escaped;
}

std::string format_json(const std::vector<Row>& rows) {
  std::string text = "[";
  for (const Row& row : rows) {
    text += &row == &rows.front() ? "\n  " : ",\n  ";
    text += json_text(row);
  }
  return text + (rows.empty() ? "]\n" : "\n]\n");
}

std::string format_csv(const std::vector<Row>& rows) {
  if (rows.empty()) return "";
  std::string text;
  std::string separator;
  for (const auto& [field, value] : rows.front().items()) {
    text += separator + csv_field(field);
    separator = ",";
  }
  for (const Row& row : rows) {
    separator = "\n";
    for (const auto& [field, unused] : rows.front().items()) {
      const auto value = row.find(field);
      text += separator + (value != row.end() ? csv_field(*value) : "");
      separator = ",";
    }
  }
  return text + "\n";
}

}  // namespace plchost
