#include "api/recording/variable_recording.hpp"

#include <cerrno>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdio_ext.h>
#include <unistd.h>

#include "api/dds/text.hpp"
#include "api/recording/csv_text.hpp"
#include "shm/base/next_on_grid.hpp"

namespace plchost {

bool comes_back(const Error& error) noexcept {
  return error.code == ErrorCode::timed_out || error.code == ErrorCode::unavailable ||
         error.code == ErrorCode::busy;
}

Result<VariableListing> sample_in(VariableListing page, std::string_view instance,
                                  const VariableQuery& query) {
  PLCHOST_TRY(is_whole(page));
  if (page.variables.empty() && !query.patterns.empty()) {
    return failure(ErrorCode::not_found,
                   fmt::format("no variable of '{}' is like {}", instance, fmt::join(query.patterns, ", ")));
  }
  return page;
}

Result<bool> sample_again_and_again(const SampleTimes& times, const SampleActions& actions) {
  constexpr Duration kLastPatience = std::chrono::seconds(1);
  const TimePoint latest = times.until == TimePoint::max() ? times.until : times.until + kLastPatience;
  bool silent = false;
  bool first = true;
  TimePoint next = MonotonicClock::now();
  do {
    const auto sample = actions.sample(first ? TimePoint::max() : latest);
    if (sample) {
      silent = false;
      if (!actions.use(*sample)) return true;
    } else if (first || !comes_back(sample.error())) {
      return std::unexpected(sample.error());
    } else if (!std::exchange(silent, true)) {
      actions.tell_silence(sample.error());
    }
    first = false;
    const TimePoint now = MonotonicClock::now();
    next = next_on_grid(next, now, times.interval);
    if (now >= times.until || next > times.until) return !silent;
  } while (actions.sleep_until(next));
  return true;
}

std::string recording_head(const VariableListing& sample) {
  std::string head = "time,time_unix_ns,consistent";
  for (const plc_VariableRecord& variable : sample.variables)
    head += "," + csv_cell(dds::text_of(variable.name));
  return head + ",forced";
}

std::string recording_line(const VariableListing& sample) {
  std::string line =
      fmt::format("{},{},{}", time_text(sample.time_unix_ns), sample.time_unix_ns, sample.consistent);
  std::string forced;
  for (const plc_VariableRecord& variable : sample.variables) {
    line += "," + csv_cell(dds::text_of(variable.value));
    if (variable.forced) forced.append(forced.empty() ? "" : " ").append(dds::text_of(variable.name));
  }
  return line + "," + csv_cell(forced);
}

Result<std::string> RecordingText::lines_of(const VariableListing& sample) {
  std::string names = recording_head(sample);
  if (names_.empty()) {
    names_ = std::move(names);
    return names_ + "\n" + recording_line(sample) + "\n";
  }
  if (names == names_) return recording_line(sample) + "\n";
  return failure(ErrorCode::wrong_state, "the application has other variables than when the recording began");
}

Result<void> RecordingFile::write(const std::string& lines) {
  if (!path_.empty() && !own_) {
    own_.reset(std::fopen(path_.c_str(), "we"));
    if (!own_) return failure(ErrorCode::system, "cannot write " + path_, errno);
  }
  std::FILE* const file = own_ ? own_.get() : stdout;
  if (std::fwrite(lines.data(), 1, lines.size(), file) != lines.size() || std::fflush(file) != 0) {
    const int error = errno;
    cut();
    return failure(ErrorCode::system,
                   fmt::format("cannot write the recording, which ends after {} samples", samples_), error);
  }
  bytes_ += static_cast<off_t>(lines.size());
  ++samples_;
  return {};
}

// A device or pipe cannot be cut.
void RecordingFile::cut() noexcept {
  if (!own_) return;
  ::__fpurge(own_.get());
  (void)!::ftruncate(::fileno(own_.get()), bytes_);
}

}  // namespace plchost
