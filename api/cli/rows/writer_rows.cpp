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
  static const std::vector<Column> columns{
      {"host", "HOST"},           {"writer", "WRITER"},       {"present", "PRESENT"},
      {"received", "RECEIVED"},   {"delivered", "DELIVERED"}, {"no_task", "NO-TASK"},
      {"rejected", "REJECTED"},   {"lost", "LOST"},           {"early", "EARLY"},
      {"duplicate", "DUPLICATE"}, {"last", "LAST POST"}};
  return columns;
}

}  // namespace plchost
