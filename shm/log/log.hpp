#pragma once

#include <string>

#include <spdlog/spdlog.h>

// libfmt has it, and its header does not say so: each file that logs would compile all of fmt's formatting
// anew. With clang it has another name than with the g++ that libfmt was built with.
#ifndef __clang__
extern template void fmt::detail::vformat_to<char>(fmt::detail::buffer<char>&, fmt::string_view,
                                                   fmt::basic_format_args<fmt::buffer_context<char>>,
                                                   fmt::detail::locale_ref);
#endif

namespace plchost {

/// Makes standard error the log of this process: "2026-01-31 12:00:00.000 warning plchostd: text". Set-up.
/// It never waits for the reader of that: lines that find a full pipe are lost, and counted in a later line.
/// Never called from a real-time thread; `level` is one of trace, debug, info, warning, error.
void start_log(const std::string& program, const std::string& level = "info");

/// `pattern`: of a line, as spdlog says it. Its %v is one line of printable UTF-8, whatever was logged.
/// Set-up, after start_log().
void set_log_pattern(const std::string& pattern);

}  // namespace plchost
