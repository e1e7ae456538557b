#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace plchost {

/// One line of output: a flat object, fields in order, units in the field names. What --json shows; a table
/// shows some of it.
using Row = nlohmann::ordered_json;

/// A column of a table: which field, under which header, with how many decimals if it is a number with a
/// fraction.
struct Column {
  const char* field;
  const char* header;
  int decimals = 1;
};

/// An aligned table with a header line: texts to the left, numbers to the right. An empty text is shown as
/// "-". Characters that could drive a terminal are shown as '?'. `coloured`: states are, by how well they
/// are.
[[nodiscard]] std::string format_table(const std::vector<Row>& rows, const std::vector<Column>& columns,
                                       bool coloured = false);

/// One "field  value" line for each field, in characters as above.
[[nodiscard]] std::string format_fields(const Row& row);

/// JSON in one line, with its control characters escaped, those above ASCII too.
[[nodiscard]] std::string json_text(const Row& row);

/// An array of objects, one on each line.
[[nodiscard]] std::string format_json(const std::vector<Row>& rows);

/// Comma-separated values as in RFC 4180, but with plain line ends: a header with the names of all fields of
/// the first row, then a line for each row. What is no plain value stands as JSON in its field.
[[nodiscard]] std::string format_csv(const std::vector<Row>& rows);

}  // namespace plchost
