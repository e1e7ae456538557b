#include "api/cli/verbs/variable_recording.hpp"

#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "api/cli/interrupt.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

struct RecordArguments {
  std::string instance;
  std::vector<std::string> names;
  double interval_s = 0.1;
  double duration_s = 0;  // 0: until Ctrl-C
  std::string file;       // empty: the standard output
};

int record(CliSession& session, const RecordArguments& arguments) {
  catch_interrupts();
  const auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  VariableSampler sampler(session, *host, arguments.instance,
                          {.patterns = arguments.names, .forced = false, .after = 0});
  RecordingText text;
  RecordingFile file(arguments.file);
  SampleTimes times{.interval = of_seconds(arguments.interval_s)};
  if (arguments.duration_s > 0) times.until = MonotonicClock::now() + of_seconds(arguments.duration_s);
  Result<void> written;
  const int code = sample_until_interrupted(sampler, times, [&](const VariableListing& sample) {
    const auto lines = text.lines_of(sample);
    written = lines ? file.write(*lines) : Result<void>(std::unexpected(lines.error()));
    return written.has_value();
  });
  if (!written) return CliSession::fail(written.error());
  if (!arguments.file.empty() && file.samples() > 0 && (code == kExitDone || code == kExitNoAnswer))
    session.say(fmt::format("{} in {}", count_text(file.samples(), "sample"), arguments.file));
  return code;
}

}  // namespace

int sample_until_interrupted(VariableSampler& sampler, const SampleTimes& times,
                             const std::function<bool(const VariableListing&)>& use) {
  if (interrupted()) return kExitDone;
  const auto answered = sample_again_and_again(
      times, {.sample = [&](TimePoint latest) { return sampler.sample(latest); },
              .use = use,
              .sleep_until =
                  [](TimePoint next) {
                    sleep_until_interrupted(next);
                    return !interrupted();
                  },
              .tell_silence = [](const Error& error) { (void)CliSession::fail(error); }});
  if (!answered) return CliSession::fail(answered.error());
  return *answered ? kExitDone : kExitNoAnswer;
}

void add_record_variables(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<RecordArguments>();
  plcctl.verb("record", "Write samples of variables, or what tasks do, into a file")
      .noun("variables", "Samples of variables as CSV, each of one moment in which no task is within a cycle",
            [&session, arguments] { return record(session, *arguments); })
      .argument("INSTANCE", arguments->instance)
      .arguments("VARIABLE", arguments->names, kVariableNames)
      .option("--interval", arguments->interval_s, "seconds between two samples (default 0.1)",
              kMinSampleSeconds, kMaxSampleSeconds)
      .option("--duration", arguments->duration_s, "seconds; 0: until Ctrl-C (default 0)", 0.0, 1e9)
      .optional("--file", arguments->file, "the file; without it: the standard output");
}

}  // namespace plchost
