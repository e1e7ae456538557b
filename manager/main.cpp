#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "api/security/identity.hpp"
#include "instances/launch/option_names.hpp"
#include "manager/config/config_changes.hpp"
#include "manager/config/load_config.hpp"
#include "manager/fix_host.hpp"
#include "manager/manager.hpp"
#include "manager/store/store_application.hpp"
#include "manager/store/store_process.hpp"
#include "manager/store/wish_writer.hpp"
#include "manager/surroundings.hpp"
#include "manager/system/child_process.hpp"
#include "shm/base/names.hpp"
#include "shm/guard/memory_guard.hpp"
#include "shm/log/log.hpp"
#include "shm/log/log_levels.hpp"

namespace plchost {

namespace {

constexpr int kExitDone = 0;
constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

struct Options {
  std::string config;
  std::string check_config;
  std::string log_level;
  std::string programs;
  std::string fix_host;
  std::string root;
};

constexpr std::array kFixWords = {std::pair{std::string_view("print"), FixMode::print},
                                  std::pair{std::string_view("apply"), FixMode::apply},
                                  std::pair{std::string_view("revert"), FixMode::revert}};

// An empty variable of a script must not make an order about an image one about this machine.
std::string check_root(const std::string& folder) {
  std::error_code ignored;
  if (!folder.empty() && !std::filesystem::equivalent(folder, "/", ignored)) return {};
  return fmt::format("'{}' names this machine; leave it out", folder);
}

void describe(CLI::App& app, Options& options) {
  app.set_version_flag("--version", PLCHOST_VERSION);
  auto* config = app.add_option(
      "--config", options.config,
      "Run with this configuration file; with --fix-host it may be left out: /etc/plchost/plchost.toml");
  auto* check = app.add_option("--check-config", options.check_config,
                               "Only check this configuration file, and all that a start needs");
  config->excludes(check);
  app.add_option("--log-level", options.log_level,
                 fmt::format("Instead of the file's: {}", join_names(kLogLevels)))
      ->check(CLI::IsMember(std::vector<std::string>(kLogLevels.begin(), kLogLevels.end())));
  app.add_option("--programs", options.programs,
                 "Folder of plc-instance and plchost-dds; default: that of plchostd");
  auto* fix = app.add_option("--fix-host", options.fix_host,
                             "Set this host up for the cores of its instances, and end: print the files that "
                             "do it, apply or revert them. 'plcctl check host --fix' calls this")
                  ->check(CLI::IsMember({"print", "apply", "revert"}))
                  ->type_name("WORD");
  fix->excludes(check);
  app.add_option("--root", options.root,
                 "With --fix-host: the folder of an image, where files are written and nothing is run")
      ->check(check_root)
      ->check(CLI::ExistingDirectory)
      ->needs(fix);
  std::string footer =
      "A changed key of the configuration, after 'systemctl reload', SIGHUP or 'plcctl reload host':\n";
  for (const std::string& row : key_table()) footer += fmt::format("  {}\n", row);
  app.footer(footer);
}

Result<void> check_identity(const ManagerConfig& config) {
  if (config.dds.identity.empty()) return {};
  PLCHOST_TRY_ASSIGN(const auto identity, security::check_identity(config.dds.identity));
  return security::check_host_identity(identity.subject, config.host.name);
}

std::string programs_of(const Options& options) {
  return options.programs.empty() ? program_directory() : options.programs;
}

int check_only(const std::string& file, const std::string& programs) {
  const auto config = load_config(file, start_surroundings(programs));
  if (config) {
    // Not when it runs: its instances are worth more than the way to them.
    if (const auto good = check_identity(*config); !good) {
      fmt::print("{}: [dds] identity: {}\n", file, good.error().describe());
      return kExitFailed;
    }
    fmt::print("{}: ok, {}\n", file, plchost::count_text(config->instances.size(), "instance"));
    return kExitDone;
  }
  for (const std::string& error : config.error()) fmt::print("{}\n", error);
  return kExitFailed;
}

std::expected<ManagerConfig, ConfigErrors> read_config(const Options& options) {
  auto config = load_config(options.config, config_surroundings());
  if (config && !options.log_level.empty()) config->host.log_level = options.log_level;
  return config;
}

// Only the cores count: a host can be set up before its applications are there. The cores that are isolated
// now may be those of an earlier configuration.
int fix(Options options) {
  while (options.root.ends_with('/')) options.root.pop_back();
  const auto* const word =
      std::ranges::find(kFixWords, options.fix_host, [](const auto& one) { return one.first; });
  const FixOrder order{.mode = word->second, .root = options.root};
  if (const auto may = may_fix_host(order); !may) {
    fmt::print(stderr, "plchostd: {}\n", may.error().describe());
    return kExitFailed;
  }
  if (order.mode == FixMode::revert) return fix_host(order, {}) ? kExitDone : kExitFailed;
  if (options.config.empty()) options.config = options.root + "/etc/plchost/plchost.toml";
  auto surroundings = config_surroundings();
  const auto online = facts_below(options.root).cores("/sys/devices/system/cpu/online");
  if (online && !online->empty()) surroundings.online_cores = *online;
  surroundings.isolated_cores.clear();
  surroundings.check_files = false;
  const auto config = load_config(options.config, surroundings);
  if (config) return fix_host(order, *config) ? kExitDone : kExitFailed;
  for (const std::string& error : config.error()) fmt::print(stderr, "{}\n", error);
  return kExitFailed;
}

int run(const Options& options) {
  const auto config = read_config(options);
  if (!config) {
    for (const std::string& error : config.error()) fmt::print(stderr, "{}\n", error);
    return kExitFailed;
  }
  start_log("plchostd", config->host.log_level);
  std::error_code ignored;
  const auto file = std::filesystem::absolute(options.config, ignored);
  auto manager = Manager::create(*config, {.file = file.string(),
                                           .folder = file.parent_path().string(),
                                           .programs = programs_of(options),
                                           .schedulers = config_surroundings().schedulers,
                                           .read = [&options] { return read_config(options); }});
  if (!manager) {
    spdlog::error("{}", manager.error().describe());
    return kExitFailed;
  }
  if (const auto ran = (*manager)->run(); !ran) {
    spdlog::error("{}", ran.error().describe());
    return kExitFailed;
  }
  return kExitDone;
}

int plchostd_main(int argc, const char* const* argv) {
  const std::span arguments(argv, static_cast<std::size_t>(argc));
  // Not for people: the manager calls it.
  if (arguments.size() == 3 && std::string_view(arguments[1]) == kStoreOption)
    return store_main(arguments[2]);
  if (arguments.size() == 2 && std::string_view(arguments[1]) == kWishWriterOption) return wish_writer_main();
  Options options;
  CLI::App app("The manager of this host's PLC runtimes.", "plchostd");
  describe(app, options);
  try {
    app.parse(argc, argv);
    if (options.config.empty() && options.check_config.empty() && options.fix_host.empty()) {
      throw CLI::RequiredError("--config FILE, --check-config FILE or --fix-host WORD");
    }
  } catch (const CLI::ParseError& error) {
    const std::vector<std::string> words(arguments.begin() + 1, arguments.end());
    const std::string hint = unknown_option(words, option_names(app));
    // Else the value of an option is wrong, which may look like an option: "--core -1".
    const bool unknown = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
    if (unknown && !hint.empty()) {
      fmt::print(stderr, "plchostd: {}\n", hint);
      return kExitUsage;
    }
    return app.exit(error) == 0 ? kExitDone : kExitUsage;
  }
  if (!options.fix_host.empty()) return fix(options);
  return options.config.empty() ? check_only(options.check_config, programs_of(options)) : run(options);
}

}  // namespace

}  // namespace plchost

int main(int argc, char** argv) {
  // A reader of the log may end: no reason to leave the instances alone.
  (void)std::signal(SIGPIPE, SIG_IGN);
  plchost::MemoryGuard::watch_process();
  return plchost::plchostd_main(argc, argv);
}
