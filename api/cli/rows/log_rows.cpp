#include "api/cli/rows/log_rows.hpp"

#include <utility>

#include <fmt/format.h>

#include "api/cli/rows/rows.hpp"
#include "api/dds/code_names.hpp"
#include "shm/base/names.hpp"

namespace plchost {

Row to_row(std::string_view host, std::string_view instance, const LogText& line) {
  return {{"host", host},
          {"instance", instance},
          {"sequence", line.sequence},
          {"missing", line.missing},
          {"time", time_text(line.time_unix_ns)},
          {"time_unix_ns", line.time_unix_ns},
          {"pid", line.pid},
          {"level", dds::log_level_name(std::to_underlying(line.level))},
          {"source", dds::log_source_name(std::to_underlying(line.source))},
          {"text", line.text}};
}

const std::vector<Column>& log_columns() {
  static const std::vector<Column> columns{{.field = "time", .header = "TIME"},
                                           {.field = "level", .header = "LEVEL", .rank = 2},
                                           {.field = "source", .header = "SOURCE", .rank = 1},
                                           {.field = "text", .header = "TEXT"}};
  return columns;
}

std::string format_log_line(const LogText& line) {
  const std::string missing =
      line.missing > 0 ? fmt::format("({} lines are missing here)\n", line.missing) : std::string();
  return fmt::format("{}{}  {:<7}  {:<11}  {}\n", missing, time_text(line.time_unix_ns),
                     dds::log_level_name(std::to_underlying(line.level)),
                     dds::log_source_name(std::to_underlying(line.source)), printable(line.text));
}

}  // namespace plchost
