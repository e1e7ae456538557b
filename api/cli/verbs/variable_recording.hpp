#pragma once

#include <functional>

#include "api/cli/verbs/variable_sampler.hpp"
#include "api/recording/variable_recording.hpp"

namespace plchost {

/// The interval of samples as an option has it.
inline constexpr double kMinSampleSeconds = std::chrono::duration<double>(kMinSampleInterval).count();
inline constexpr double kMaxSampleSeconds = std::chrono::duration<double>(kMaxSampleInterval).count();
[[nodiscard]] inline Duration of_seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

/// Takes samples until Ctrl-C, until `use` returns false, or until that time; the exit code. A host or an
/// instance that is started anew is waited for; that is told once. kExitNoAnswer: it was not back in time.
[[nodiscard]] int sample_until_interrupted(VariableSampler& sampler, const SampleTimes& times,
                                           const std::function<bool(const VariableListing&)>& use);

/// "record variables", with its verb.
void add_record_variables(const Command& plcctl, CliSession& session);
/// "list variables", "list forces" and "watch variables", below their verbs: variable_verbs.cpp.
void add_list_variables(const Command& verb, CliSession& session);
void add_watch_variables(const Command& verb, CliSession& session);

}  // namespace plchost
