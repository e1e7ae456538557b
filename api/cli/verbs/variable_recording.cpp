#include "api/cli/verbs/variable_recording.hpp"

#include <cerrno>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <stdio_ext.h>
#include <unistd.h>

#include "api/cli/interrupt.hpp"
#include "api/cli/rows/variable_rows.hpp"
#include "shm/base/names.hpp"
#include "shm/base/next_on_grid.hpp"

namespace plchost {

namespace {

struct RecordArguments {
  std::string instance;
  std::vector<std::string> names;
  double interval_s = 0.1;
  double duration_s = 0;  // 0: until Ctrl-C
  std::string file;       // empty: the standard output
};

/// Writes samples as CSV: a line with the names, then one for each sample. Of a file of its own no line is
/// left that could not be written whole: its last value would be another one.
class Recording {
 public:
  Recording(std::FILE* file, bool own) noexcept : file_(file), own_(own) {}

  /// wrong_state: the application has other variables by now. system: the file takes no more.
  Result<void> add(const VariableListing& sample) {
    std::string names = recording_head(sample);
    std::string text;
    if (names_.empty()) {
      text = names + "\n";
      names_ = std::move(names);
    } else if (names != names_) {
      return failure(ErrorCode::wrong_state,
                     "the application has other variables than when the recording began");
    }
    text += recording_line(sample) + "\n";
    if (std::fwrite(text.data(), 1, text.size(), file_) != text.size() || std::fflush(file_) != 0) {
      const int error = errno;
      if (own_) cut();
      return failure(ErrorCode::system,
                     fmt::format("cannot write the recording, which ends after {} samples", samples_), error);
    }
    bytes_ += static_cast<off_t>(text.size());
    ++samples_;
    return {};
  }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }

 private:
  // A device or pipe cannot be cut.
  void cut() noexcept {
    ::__fpurge(file_);
    (void)!::ftruncate(::fileno(file_), bytes_);
  }

  std::FILE* file_;
  bool own_;
  off_t bytes_ = 0;  // of whole lines
  std::string names_;
  std::uint64_t samples_ = 0;
};

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};

int record(CliSession& session, const RecordArguments& arguments) {
  catch_interrupts();
  const auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  VariableSampler sampler(session, *host, arguments.instance,
                          {.patterns = arguments.names, .forced = false, .after = 0});
  std::unique_ptr<std::FILE, CloseFile> file;
  std::optional<Recording> recording;
  // With the first sample: a command that is refused leaves an earlier recording as it is.
  const auto begin_file = [&]() -> Result<void> {
    if (recording) return {};
    if (!arguments.file.empty()) {
      file.reset(std::fopen(arguments.file.c_str(), "we"));
      if (!file) return failure(ErrorCode::system, "cannot write " + arguments.file, errno);
    }
    recording.emplace(file ? file.get() : stdout, file != nullptr);
    return {};
  };
  const TimePoint begin = MonotonicClock::now();
  const auto length =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(arguments.duration_s));
  const TimePoint until = arguments.duration_s > 0 ? begin + length : TimePoint::max();
  Result<void> written;
  const int code = sample_again_and_again(sampler, SampleTimes(arguments.interval_s), until,
                                          [&](const VariableListing& sample) {
                                            written = begin_file();
                                            if (written) written = recording->add(sample);
                                            return written.has_value();
                                          });
  if (!written) return CliSession::fail(written.error());
  if (file && recording && (code == kExitDone || code == kExitNoAnswer))
    session.say(fmt::format("{} in {}", count_text(recording->samples(), "sample"), arguments.file));
  return code;
}

}  // namespace

TimePoint SampleTimes::after(TimePoint planned, TimePoint now) const noexcept {
  return next_on_grid(planned, now, interval_);
}

int sample_again_and_again(VariableSampler& sampler, const SampleTimes& times, TimePoint until,
                           const std::function<bool(const VariableListing&)>& use) {
  constexpr Duration kLastPatience = std::chrono::seconds(1);
  const TimePoint latest = until == TimePoint::max() ? until : until + kLastPatience;
  bool silent = false;
  bool first = true;
  for (TimePoint next = MonotonicClock::now(); !interrupted();) {
    const auto sample = sampler.sample(first ? TimePoint::max() : latest);
    if (sample) {
      silent = false;
      if (!use(*sample)) break;
    } else if (first || !comes_back(sample.error())) {
      return CliSession::fail(sample.error());
    } else if (!std::exchange(silent, true)) {
      (void)CliSession::fail(sample.error());
    }
    first = false;
    const TimePoint now = MonotonicClock::now();
    next = times.after(next, now);
    if (now >= until || next > until) return silent ? kExitNoAnswer : kExitDone;
    sleep_until_interrupted(next);
  }
  return kExitDone;
}

void add_record_variables(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<RecordArguments>();
  plcctl.verb("record", "Write samples of variables into a file")
      .noun("variables", "Samples of variables as CSV, each of one moment in which no task is within a cycle",
            [&session, arguments] { return record(session, *arguments); })
      .argument("INSTANCE", arguments->instance)
      .arguments("VARIABLE", arguments->names, kVariableNames)
      .option("--interval", arguments->interval_s, "seconds between two samples (default 0.1)",
              kMinSampleInterval, kMaxSampleInterval)
      .option("--duration", arguments->duration_s, "seconds; 0: until Ctrl-C (default 0)", 0.0, 1e9)
      .optional("--file", arguments->file, "the file; without it: the standard output");
}

}  // namespace plchost
