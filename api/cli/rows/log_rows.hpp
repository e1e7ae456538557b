#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/cli/rows/table.hpp"
#include "shm/pool/log_ring.hpp"

namespace plchost {

/// A line of the log of an instance, put together from its records.
struct LogText {
  std::uint64_t sequence = 0;  ///< of its last record
  std::uint64_t missing = 0;   ///< records that are missing before it
  std::int64_t time_unix_ns = 0;
  std::int32_t pid = 0;
  LogLevel level = LogLevel::info;
  LogSource source = LogSource::output;
  std::string text;
};

/// Makes lines of records that come in pieces.
class LogLines {
 public:
  /// The lines that are whole by now, in their order.
  [[nodiscard]] std::vector<LogText> add(const std::vector<LogRecord>& records);
  /// The numbers begin anew.
  void begin_anew() { *this = {}; }

 private:
  std::uint64_t last_ = 0;  // 0: none was seen
  std::uint64_t missing_ = 0;
  std::string begun_;
};

[[nodiscard]] Row to_row(std::string_view host, std::string_view instance, const LogText& line);
[[nodiscard]] const std::vector<Column>& log_columns();
/// "2026-11-21T10:48:59.502Z  warning  application  text", for people.
[[nodiscard]] std::string format_log_line(const LogText& line);

}  // namespace plchost
