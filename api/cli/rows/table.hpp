#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "shm/base/result.hpp"

namespace plchost {

/// One line of output: a flat object, fields in order, units in the field names. The output of --json; a
/// table shows some of it.
using Row = nlohmann::ordered_json;

/// A column of a table: which field, under which header, with how many decimals if it is a number with a
/// fraction.
struct Column {
  const char* field;
  const char* header;
  int decimals = 1;
  /// Where the table is wider than the terminal, columns of the greatest rank are left out first; 0: never.
  int rank = 0;
  /// This number means that there is none; a table shows "-".
  std::int64_t none = std::numeric_limits<std::int64_t>::min();
};

struct TableStyle {
  bool coloured = false;  ///< states are, by how well they are
  std::size_t width = 0;  ///< characters of the terminal; 0: the table is as wide as it is
};

/// How well that is which is in a state.
enum class StateHealth : std::uint8_t { none, well, uncertain, bad };
/// `state`: as a row says it. Of all other words: none.
[[nodiscard]] StateHealth health_of(std::string_view state) noexcept;

/// The lines of format_table(), the header first.
[[nodiscard]] std::vector<std::string> table_lines(const std::vector<Row>& rows,
                                                   const std::vector<Column>& columns,
                                                   const TableStyle& style = {});

/// An aligned table with a header line: texts to the left, numbers to the right. An empty text is shown as
/// "-". Characters that could drive a terminal are shown as '?'.
[[nodiscard]] std::string format_table(const std::vector<Row>& rows, const std::vector<Column>& columns,
                                       const TableStyle& style = {});

/// The columns that the user names ("host,state"): of `columns`, or of a field that rows have and no column.
/// invalid_argument: an unknown one; lists those that there are.
[[nodiscard]] Result<std::vector<Column>> choose_columns(const std::vector<std::string>& fields,
                                                         const std::vector<Row>& rows,
                                                         const std::vector<Column>& columns);

/// Sorts by a field: numbers by size, texts by their letters; "-pid": the greatest first. Equal ones stay in
/// their order. invalid_argument: no row has it; lists those that there are.
[[nodiscard]] Result<void> sort_rows(std::vector<Row>& rows, std::string_view field);

/// One "field  value" line for each field, in characters as above.
[[nodiscard]] std::string format_fields(const Row& row);

/// JSON in one line, with its control characters escaped, those above ASCII too.
[[nodiscard]] std::string json_text(const Row& row);

/// An array of objects, one on each line.
[[nodiscard]] std::string format_json(const std::vector<Row>& rows);

/// Comma-separated values as in RFC 4180, but with plain line ends: a header with the names of all fields of
/// the first row, then a line for each row. A value that is not plain stands as JSON in its field.
[[nodiscard]] std::string format_csv(const std::vector<Row>& rows);

}  // namespace plchost
