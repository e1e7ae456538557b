#include "api/cli/rows/rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {

Row to_row(const plc_ApplicationStatus& status, bool loaded) {
  constexpr std::size_t kShownDigits = 12;
  const std::string_view digest = dds::text_of(status.sha256);
  const bool sent = status.version > 0;
  return {{"host", dds::text_of(status.host)},
          {"instance", dds::text_of(status.instance)},
          {"version", sent ? Row(status.version) : Row()},
          {"file", sent ? dds::text_of(status.file_name) : dds::text_of(status.path)},
          {"size", sent ? Row(status.size) : Row()},
          {"sent", time_text(status.stored_unix_ns)},
          {"sent_unix_ns", status.stored_unix_ns},
          {"by", dds::text_of(status.by)},
          {"from", dds::text_of(status.from)},
          {"sha256", digest},
          {"digest", digest.substr(0, kShownDigits)},
          {"loaded", loaded ? "loaded" : ""},
          {"boot", status.boot ? "boot" : ""},
          {"path", dds::text_of(status.path)},
          {"before", dds::text_of(status.before)}};
}

Row row_of_loaded(const std::string& host, const std::string& instance, const std::string& path) {
  return {{"host", host}, {"instance", instance}, {"version", ""}, {"file", path}, {"size", ""},
          {"sent", ""},   {"sent_unix_ns", 0},    {"by", ""},      {"from", ""},   {"sha256", ""},
          {"digest", ""}, {"loaded", "loaded"},   {"boot", ""},    {"path", path}, {"before", ""}};
}

const std::vector<Column>& application_columns() {
  static const std::vector<Column> columns{
      {.field = "host", .header = "HOST", .rank = 1}, {.field = "instance", .header = "INSTANCE"},
      {.field = "version", .header = "VERSION"},      {.field = "file", .header = "FILE", .rank = 2},
      {.field = "size", .header = "SIZE", .rank = 5}, {.field = "sent", .header = "SENT", .rank = 3},
      {.field = "by", .header = "BY", .rank = 6},     {.field = "digest", .header = "SHA256", .rank = 7},
      {.field = "loaded", .header = "LOADED"},        {.field = "boot", .header = "BOOT"}};
  return columns;
}

}  // namespace plchost
