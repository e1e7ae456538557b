#pragma once

#include <string>
#include <string_view>

#include "api/cli/rows/status_rows.hpp"
#include "api/client/log_reader.hpp"

namespace plchost {

/// A line has what its last record has, and the text of all of them.
[[nodiscard]] dds::Computed<plc_LogRecord, Row> computed_of(const plc_LogRecord& last, std::string_view host,
                                                            std::string_view instance, const LogText& line);
[[nodiscard]] Row to_row(std::string_view host, std::string_view instance, const LogText& line);
/// "2026-11-21T10:48:59.502Z  warning  application  text", for people.
[[nodiscard]] std::string format_log_line(const LogText& line);

}  // namespace plchost
