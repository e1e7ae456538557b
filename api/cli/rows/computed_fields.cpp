#include "api/cli/rows/computed_fields.hpp"

#include "api/dds/code_names.hpp"
#include "api/dds/text.hpp"

namespace plchost {

dds::Computed<plc_ExceptionStatus, Row> computed_of(const plc_ExceptionStatus& status) {
  return {.stopped = status.count == 0 ? "" : (status.whole_application ? "application" : "task")};
}

dds::Computed<plc_Transition, Row> computed_of(const plc_Transition& transition) {
  return {.from = dds::transition_state_name(transition.source, transition.from_state),
          .to = dds::transition_state_name(transition.source, transition.to_state)};
}

dds::Computed<plc_ApplicationStatus, Row> computed_of(const plc_ApplicationStatus& status, bool loaded) {
  constexpr std::size_t kShownDigits = 12;
  const bool sent = status.version > 0;
  return {.file = sent ? dds::text_of(status.file_name) : dds::text_of(status.path),
          .digest = dds::text_of(status.sha256).substr(0, kShownDigits),
          .loaded = loaded ? "loaded" : "",
          .boot = status.boot ? "boot" : ""};
}

}  // namespace plchost
