#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/cli/rows/table.hpp"
#include "api/client/log_reader.hpp"

namespace plchost {

[[nodiscard]] Row to_row(std::string_view host, std::string_view instance, const LogText& line);
[[nodiscard]] const std::vector<Column>& log_columns();
/// "2026-11-21T10:48:59.502Z  warning  application  text", for people.
[[nodiscard]] std::string format_log_line(const LogText& line);

}  // namespace plchost
