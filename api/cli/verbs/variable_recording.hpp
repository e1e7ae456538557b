#pragma once

#include <functional>

#include "api/cli/verbs/variable_sampler.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Seconds between two samples.
inline constexpr double kMinSampleInterval = 0.01;
inline constexpr double kMaxSampleInterval = 3600;

/// When samples are taken: at absolute times, so that none of them shifts those behind it.
class SampleTimes {
 public:
  explicit SampleTimes(double interval_s)
      : interval_(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(interval_s))) {}
  /// The one after `planned`, or, if that is over, the next one on the same grid.
  [[nodiscard]] TimePoint after(TimePoint planned, TimePoint now) const noexcept;

 private:
  Duration interval_;
};

/// Takes samples until Ctrl-C, until `use` returns false, or until that time; the exit code. A host or an
/// instance that is started anew is waited for; that is told once. kExitNoAnswer: it was not back in time.
[[nodiscard]] int sample_again_and_again(VariableSampler& sampler, const SampleTimes& times, TimePoint until,
                                         const std::function<bool(const VariableListing&)>& use);

/// "record variables", with its verb.
void add_record_variables(const Command& plcctl, CliSession& session);
/// "list variables", "list forces" and "watch variables", below their verbs: variable_verbs.cpp.
void add_list_variables(const Command& verb, CliSession& session);
void add_watch_variables(const Command& verb, CliSession& session);

}  // namespace plchost
