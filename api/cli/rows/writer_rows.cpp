#include "api/cli/rows/rows.hpp"
#include "api/dds/guid.hpp"
#include "api/dds/text.hpp"

namespace plchost {

Row to_row(const plc_WriterStatus& status) {
  const dds::Guid source = dds::Guid::from(status.source);
  return {{"host", dds::text_of(status.host)},
          {"writer", source == dds::Guid{} ? "all" : source.hex()},
          {"present", status.present},
          {"received", status.received},
          {"delivered", status.delivered},
          {"no_task", status.no_task},
          {"rejected", status.rejected},
          {"duplicate", status.duplicate},
          {"early", status.early},
          {"lost", status.lost},
          {"last_sequence", status.last_sequence},
          {"last", time_text(status.last_unix_ns)},
          {"last_unix_ns", status.last_unix_ns}};
}

const std::vector<Column>& writer_columns() {
  static const std::vector<Column> columns{{.field = "host", .header = "HOST", .rank = 1},
                                           {.field = "writer", .header = "WRITER"},
                                           {.field = "present", .header = "PRESENT", .rank = 2},
                                           {.field = "received", .header = "RECEIVED"},
                                           {.field = "delivered", .header = "DELIVERED", .rank = 3},
                                           {.field = "no_task", .header = "NO-TASK", .rank = 4},
                                           {.field = "rejected", .header = "REJECTED", .rank = 2},
                                           {.field = "lost", .header = "LOST"},
                                           {.field = "early", .header = "EARLY", .rank = 7},
                                           {.field = "duplicate", .header = "DUPLICATE", .rank = 6},
                                           {.field = "last", .header = "LAST POST", .rank = 5}};
  return columns;
}

}  // namespace plchost
