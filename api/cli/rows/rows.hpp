#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "api/cli/rows/table.hpp"
#include "api/client/control_client.hpp"

namespace plchost {

/// From samples of status topics to rows of output, where status_rows.hpp does not make them from
/// control.idl. The field names are a promise to programs.
[[nodiscard]] Row to_row(const plc_ExceptionStatus& status);
[[nodiscard]] Row to_row(const plc_Transition& transition);
/// `loaded`: it is what the instance has loaded.
[[nodiscard]] Row to_row(const plc_ApplicationStatus& status, bool loaded);
/// Of what is loaded and was never sent: a file of the host.
[[nodiscard]] Row row_of_loaded(const std::string& host, const std::string& instance,
                                const std::string& path);

/// The values of a host beyond the fields that this program knows. A name that is taken stays what it is.
void add_extension(Row& row, std::span<const plc_KeyValue> entries);

/// A time of a host in these rows, ISO 8601, UTC, to the millisecond: "2026-11-21T10:48:59.502Z". Empty for
/// none (0).
[[nodiscard]] std::string time_text(std::int64_t unix_ns);

/// Durations are in microseconds in all rows.
[[nodiscard]] constexpr double to_us(std::int64_t nanoseconds) noexcept {
  return static_cast<double>(nanoseconds) / 1000.0;
}

/// The columns of their tables.
[[nodiscard]] const std::vector<Column>& transition_columns();
[[nodiscard]] const std::vector<Column>& application_columns();

}  // namespace plchost
