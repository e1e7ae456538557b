#include "api/cli/rows/table.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

std::string cell_of(const Row& row, const char* field, int decimals) {
  const auto found = row.find(field);
  if (found == row.end() || found->is_null()) return "-";
  if (found->is_string()) {
    auto text = printable(found->get<std::string>());
    return text.empty() ? "-" : text;
  }
  if (found->is_number_float()) {
    const std::string text = fmt::format("{:.{}f}", found->get<double>(), decimals);
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
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

/// The colour of a state, as terminals number them; 0: that of all other text.
int colour_of(std::string_view field, std::string_view text) {
  constexpr int kRed = 31;
  constexpr int kGreen = 32;
  constexpr int kYellow = 33;
  if (field != "state" && field != "to") return 0;
  if (text == "running" || text == "alive") return kGreen;
  if (text == "exception" || text == "failed" || text == "silent") return kRed;
  if (text == "safe_mode" || text == "waiting" || text == "starting" || text == "stopping") return kYellow;
  return 0;
}

std::string coloured_cell(std::string_view field, std::string text) {
  const int colour = colour_of(field, text);
  return colour == 0 ? text : fmt::format("\x1b[{}m{}\x1b[0m", colour, text);
}

std::string csv_field(const Row& value) {
  if (value.is_null()) return "";
  std::string text = value.is_string() ? printable(value.get<std::string>())
                                       : value.dump(-1, ' ', false, Row::error_handler_t::replace);
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

std::string format_table(const std::vector<Row>& rows, const std::vector<Column>& columns, bool coloured) {
  std::vector<std::string> lines(rows.size() + 1);
  for (const Column& column : columns) {
    const bool last = &column == &columns.back();
    std::vector<std::string> cells{column.header};
    for (const Row& row : rows) cells.push_back(cell_of(row, column.field, column.decimals));
    const std::size_t width = width_of(std::ranges::max(cells, {}, width_of));
    const bool right = is_number(rows, column.field);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string padding(width - width_of(cells[i]), ' ');
      if (right) lines[i] += padding;
      lines[i] += coloured && i > 0 ? coloured_cell(column.field, cells[i]) : cells[i];
      if (!right && !last) lines[i] += padding;
      if (!last) lines[i] += "  ";
    }
  }
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

std::string format_fields(const Row& row) {
  std::size_t width = 0;
  for (const auto& [field, value] : row.items()) width = std::max(width, field.size());
  std::string text;
  for (const auto& [field, value] : row.items()) {
    text += fmt::format("{:<{}}  {}\n", printable(field), width, cell_of(row, field.c_str(), 3));
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
