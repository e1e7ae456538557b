#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <sys/types.h>

#include "api/dds/variable_page.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// From one sample to the next.
inline constexpr std::chrono::milliseconds kMinSampleInterval(10);
inline constexpr std::chrono::milliseconds kMaxSampleInterval = std::chrono::hours(1);

/// Whether asking again may help: a server or an instance was started anew, or is busy.
[[nodiscard]] bool comes_back(const Error& error) noexcept;

/// The page, if it is a sample: all variables that the query names, of one moment. full: they are more than
/// one page holds. not_found: there is none of them.
[[nodiscard]] Result<VariableListing> sample_in(VariableListing page, std::string_view instance,
                                                const VariableQuery& query);

/// When samples are taken: at absolute times, so that none of them shifts those behind it.
struct SampleTimes {
  Duration interval;
  TimePoint until = TimePoint::max();
};

/// How samples are taken, and what becomes of them.
struct SampleActions {
  /// It waits until then at most.
  std::function<Result<VariableListing>(TimePoint latest)> sample;
  /// False: enough.
  std::function<bool(const VariableListing&)> use;
  /// False: interrupted.
  std::function<bool(TimePoint)> sleep_until;
  /// Told once each time when there is no answer any more. Sampling goes on.
  std::function<void(const Error&)> tell_silence;
};

/// Takes samples until then, until `use` has enough, or until it is interrupted. A host or an instance that
/// is started anew is waited for. False: it was silent at the end. An error ends it if it is the first
/// answer, or if asking again does not help.
[[nodiscard]] Result<bool> sample_again_and_again(const SampleTimes& times, const SampleActions& actions);

/// The first line of a recording as CSV, and the line of each sample, as RFC 4180 has it. The last column
/// has the names of those that are forced, with blanks between, so that each other one has values alone.
[[nodiscard]] std::string recording_head(const VariableListing& sample);
[[nodiscard]] std::string recording_line(const VariableListing& sample);

/// Makes the text of a recording.
class RecordingText {
 public:
  /// The line of the sample, and before the first one the line with the names. wrong_state: the application
  /// has other variables by now.
  [[nodiscard]] Result<std::string> lines_of(const VariableListing& sample);

 private:
  std::string names_;
};

/// Takes the text of a recording, a sample at a time. Of a file of its own no line is left that could not be
/// written whole: its last value would be another one.
class RecordingFile {
 public:
  /// The file is made with the first lines: a recording that is refused leaves an earlier one as it is.
  /// @param path empty: the standard output
  explicit RecordingFile(std::string path) : path_(std::move(path)) {}

  /// system: the file cannot be made, or takes no more.
  [[nodiscard]] Result<void> write(const std::string& lines);
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  void cut() noexcept;

  std::string path_;
  std::unique_ptr<std::FILE, Close> own_;
  off_t bytes_ = 0;  // of whole lines
  std::uint64_t samples_ = 0;
};

}  // namespace plchost
