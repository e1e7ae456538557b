#include "api/cli/rows/rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {

Row to_row(const plc_ExceptionStatus& status) {
  using dds::text_of;
  return {{"host", text_of(status.host)},
          {"instance", text_of(status.instance)},
          {"count", status.count},
          {"present", status.present},
          {"time", time_text(status.time_unix_ns)},
          {"time_unix_ns", status.time_unix_ns},
          {"task", text_of(status.task)},
          {"stopped", status.count == 0 ? "" : (status.whole_application ? "application" : "task")},
          {"kind", text_of(status.kind)},
          {"signal", text_of(status.signal)},
          {"text", text_of(status.text)},
          {"address", status.address},
          {"symbol", text_of(status.symbol)},
          {"memory_address", status.memory_address},
          {"application", text_of(status.application)}};
}

}  // namespace plchost
