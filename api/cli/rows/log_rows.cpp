#include "api/cli/rows/log_rows.hpp"

#include <fmt/format.h>

#include "api/cli/rows/rows.hpp"
#include "api/dds/code_names.hpp"
#include "shm/base/names.hpp"

namespace plchost {

dds::Computed<plc_LogRecord, Row> computed_of(const plc_LogRecord& /*last*/, std::string_view host,
                                              std::string_view instance, const LogText& line) {
  return {.host = host, .instance = instance, .missing = line.missing, .text = line.text};
}

Row to_row(std::string_view host, std::string_view instance, const LogText& line) {
  return to_row(line.last.record(), host, instance, line);
}

std::string format_log_line(const LogText& line) {
  const std::string missing =
      line.missing > 0 ? fmt::format("({} missing here)\n", count_text(line.missing, "line is", "lines are"))
                       : std::string();
  return fmt::format("{}{}  {:<7}  {:<11}  {}\n", missing, time_text(line.last.time_unix_ns),
                     dds::log_level_name(line.last.level), dds::log_source_name(line.last.source),
                     printable(line.text));
}

}  // namespace plchost
