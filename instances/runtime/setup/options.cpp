#include "instances/runtime/setup/options.hpp"

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "instances/launch/option_names.hpp"
#include "schedulers/policies/registry.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log_levels.hpp"
#include "shm/pages/host_words.hpp"

namespace plchost {

namespace {

static_assert(static_cast<std::size_t>(PriorityBand::low) + 1 == kPriorityBandNames.size());
constexpr int kMaxCore = 1023;

// In CLI11 a validator returns the text of what is wrong, or nothing.
std::string fault_text(const Result<void>& result) {
  return result ? std::string() : result.error().describe();
}

std::string check_scheduler(const std::string& name) {
  const auto found = find_scheduler(name);
  return found ? std::string() : found.error().describe();
}

std::string check_instance_name(const std::string& name) {
  return fault_text(check_name("instance name", name, kMaxInstanceName));
}

std::string check_pool_name(const std::string& name) {
  return fault_text(check_name("pool name", name, kMaxInstanceName));
}

std::string check_band(const std::string& name) {
  const bool known = std::ranges::find(kPriorityBandNames, name) != kPriorityBandNames.end();
  return known ? std::string()
               : fmt::format("'{}' is no priority band: {} are", name, join_names(kPriorityBandNames));
}

std::string check_log_level(const std::string& name) {
  return is_log_level(name) ? std::string()
                            : fmt::format("'{}' is no log level: {} are", name, join_names(kLogLevels));
}

// An empty one, of a variable of the shell that is not set, would start an instance.
std::string check_path(const std::string& path) {
  return path.empty() ? "the name of the file is empty" : "";
}

void describe(CLI::App& app, Options& options) {
  LaunchOptions& launch = options.launch;
  app.set_version_flag("--version", PLCHOST_VERSION);
  app.add_option("--name", launch.name, "Name of this instance")
      ->check(check_instance_name)
      ->capture_default_str();
  app.add_option("--core", launch.cores,
                 "Cores for all of its threads: N[,N...]; default: where it was started")
      ->delimiter(',')
      ->check(CLI::Range(0, kMaxCore));
  app.add_option("--scheduler", launch.scheduler,
                 "One of " + scheduler_names() +
                     "; default: CmpScheduleOneShot if the settings say TimerMode=OneShot, else CmpSchedule")
      ->check(check_scheduler);
  app.add_option("--priority-band", launch.priority_band, "high, normal or low")
      ->check(check_band)
      ->capture_default_str();
  app.add_option("--settings", launch.settings, "Settings file, [Section] Key=Value");
  app.add_flag("--kept-settings", launch.kept_settings,
               "Use the settings as the process before came up with them, whatever the file says now");
  app.add_option("--application", launch.application, "The application, a shared object");
  app.add_option("--pool", launch.pool, "Name of the object pool")
      ->check(check_pool_name)
      ->capture_default_str();
  app.add_option("--run-directory", launch.run_directory, "Where the control socket goes; default: none");
  app.add_option("--state-directory", launch.state_directory,
                 "Where retain variables are written; default: nowhere, they stay as long as the pool");
  app.add_option("--user", launch.user,
                 "Run as this user, with no other rights than a PLC needs; default: that of the caller");
  app.add_option("--control-group", launch.control_group,
                 "Folder of the control group to run in; default: that of the caller");
  app.add_option("--oom-score", launch.oom_score,
                 "The later the lower the kernel ends this process when memory is short (oom_score_adj)")
      ->check(CLI::Range(-1000, 1000));
  app.add_option("--trusted-user", launch.trusted_users, "Numbers of other users that instances run as");
  app.add_flag("--no-debug", launch.no_debug, "Refuse an application that is a debug build");
  app.add_flag("--stopped", launch.stopped, "Load the application, do not start it");
  app.add_option("--start-kind", options.start_kind,
                 "The reason of the start, as told to the application: first, warm, cold or after-fault")
      ->check([](const std::string& name) {
        const auto kind = start_kind_of(name);
        return kind ? std::string() : kind.error().describe();
      });
  app.add_option("--report-fd", launch.report_fd,
                 "Descriptor of a socket for set-up reports; default: the log")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--log-level", launch.log_level, join_names(kLogLevels))
      ->check(check_log_level)
      ->capture_default_str();
  app.add_option("--parent", options.parent, "Process that asked for the check: its end ends the check")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--check-application", options.check_application,
                 "Only check this file as a start with the other options would, and say what is in it")
      ->check(check_path);
  app.add_option("--check-settings", options.check_settings, "Only check this settings file")
      ->check(check_path);
  app.add_flag(
      std::string(kSaveRetainOption), options.save_retain,
      "Only write the retain variables that an ended instance of this name has left in memory to their "
      "files");
}

}  // namespace

ParsedOptions parse_options(int argc, const char* const* argv) {
  Options options;
  options.launch.name = "plc";
  CLI::App app("One PLC runtime: loads an application and runs its tasks until SIGTERM or Ctrl-C.",
               "plc-instance");
  describe(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const std::vector<std::string> words(argv + 1, argv + argc);
    const std::string hint = unknown_option(words, option_names(app));
    // Else the value of an option is wrong, which may look like an option: "--core -1".
    const bool unknown = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
    if (unknown && !hint.empty()) {
      fmt::print(stderr, "plc-instance: {}\n", hint);
      return {.options = std::nullopt, .exit_code = kExitUsage};
    }
    const int code = app.exit(error);
    return {.options = std::nullopt, .exit_code = code == 0 ? 0 : kExitUsage};
  }
  if (const auto kind = start_kind_of(options.start_kind)) options.launch.start_kind = *kind;
  options.band = static_cast<PriorityBand>(
      std::ranges::find(kPriorityBandNames, options.launch.priority_band) - kPriorityBandNames.begin());
  return {.options = std::move(options), .exit_code = 0};
}

}  // namespace plchost
