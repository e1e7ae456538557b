#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace plchost {

/// The numbers are part of the DDS API.
enum class LogLevel : std::uint32_t { debug = 0, info = 1, warning = 2, error = 3 };

/// How start_log() writes a line, as spdlog's pattern.
inline constexpr const char* kLogPattern = "%Y-%m-%d %H:%M:%S.%e %l %n: %v";

/// A line that start_log() has written, in its parts.
struct LogLine {
  std::int64_t time_unix_ns = 0;
  LogLevel level = LogLevel::info;
  std::string_view program;
  std::string_view text;
};

/// Nothing: the line is of another form. The views refer into `line`. Soft threads.
[[nodiscard]] std::optional<LogLine> parse_log_line(std::string_view line);

}  // namespace plchost
