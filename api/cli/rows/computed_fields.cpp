#include "api/cli/rows/computed_fields.hpp"

#include <cstdint>

#include "api/cli/rows/rows.hpp"
#include "api/dds/code_names.hpp"
#include "api/dds/text.hpp"
#include "shm/base/wrapping.hpp"

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

dds::Computed<plc_TaskStatistics, Row> computed_of(const plc_TaskStatistics& numbers) {
  constexpr double kNsPerSecond = 1e9;
  constexpr double kPpmPerPercent = 1e4;
  const plc_CycleLoss& loss = numbers.last_loss;
  const auto after_release = [&loss](std::int64_t unix_ns) {
    const bool none_had_run = loss.lost != 0 && loss.release_unix_ns == 0;
    return none_had_run ? Row() : Row(to_us(wrapping_difference(unix_ns, loss.release_unix_ns)));
  };
  return {.since_unix_s = static_cast<double>(numbers.since_unix_ns) / kNsPerSecond,
          .elapsed_s = static_cast<double>(numbers.elapsed_ns) / kNsPerSecond,
          .last_loss_cycles = loss.lost,
          .last_loss_release = time_text(loss.release_unix_ns),
          .last_loss_start_us = after_release(loss.start_unix_ns),
          .last_loss_end_us = after_release(loss.end_unix_ns),
          .spin_share_percent = numbers.spin_ppm / kPpmPerPercent};
}

}  // namespace plchost
