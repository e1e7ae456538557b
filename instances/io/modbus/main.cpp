// plchost-modbus: Modbus devices and Modbus clients at process images.

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <expected>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "instances/io/modbus/config/load_modbus.hpp"
#include "instances/io/modbus/images/check_memories.hpp"
#include "instances/io/modbus/modbus_process.hpp"
#include "shm/base/names.hpp"
#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/guard/memory_guard.hpp"
#include "shm/log/log.hpp"
#include "shm/log/log_levels.hpp"

namespace plchost::modbus {

namespace {

constexpr int kExitUsage = 2;

struct Options {
  std::string config;
  std::string check_config;
  std::string log_level;
};

void describe(CLI::App& app, Options& options) {
  app.set_version_flag("--version", PLCHOST_VERSION);
  auto* config = app.add_option("--config", options.config, "Run with this configuration file");
  auto* check = app.add_option("--check-config", options.check_config, "Only check this configuration file");
  config->excludes(check);
  const std::vector<std::string> levels(kLogLevels.begin(), kLogLevels.end());
  app.add_option("--log-level", options.log_level,
                 fmt::format("Instead of the file's: {}", join_names(kLogLevels)))
      ->check(CLI::IsMember(levels));
}

// The mask is set as a whole, before any thread is made.
UniqueFd take_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);  // of the terminal that is closed
  ::sigprocmask(SIG_SETMASK, &signals, nullptr);
  (void)std::signal(SIGPIPE, SIG_IGN);
  return UniqueFd(::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
}

// Two processes of one file would write the outputs of the same devices. Images of inputs and the port of the
// server are refused to the second one in any case. The kernel ends the claim with the process.
Result<UniqueFd> hold_alone(const std::string& file) {
  UniqueFd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!fd) return failure(ErrorCode::system, file, errno);
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) return fd;
  if (errno != EWOULDBLOCK) return failure(ErrorCode::system, file, errno);
  return failure(ErrorCode::busy,
                 fmt::format("{}: another plchost-modbus runs with this file; end that one first", file));
}

std::expected<ModbusConfig, ConfigErrors> load(const std::string& file) {
  auto config = load_modbus_config(file);
  if (!config) return config;
  ConfigErrors errors = check_memories(*config, file);
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return config;
}

int check_only(const std::string& file) {
  const auto config = load(file);
  if (config) {
    fmt::print("{}: ok, {}, {}{}\n", file, count_text(config->devices.size(), "device"),
               count_text(config->images.size(), "image"), config->server ? ", a server" : "");
    return EXIT_SUCCESS;
  }
  for (const std::string& error : config.error()) fmt::print("{}\n", error);
  return EXIT_FAILURE;
}

int run(const Options& options) {
  const auto config = load(options.config);
  if (!config) {
    for (const std::string& error : config.error()) fmt::print(stderr, "{}\n", error);
    return EXIT_FAILURE;
  }
  start_log("plchost-modbus", options.log_level.empty() ? config->process.log_level : options.log_level);
  const auto alone = hold_alone(options.config);
  if (!alone) {
    spdlog::error("{}", alone.error().describe());
    return EXIT_FAILURE;
  }
  const UniqueFd signals = take_signals();
  if (!signals) {
    spdlog::error("signalfd: {}", errno);
    return EXIT_FAILURE;
  }
  auto process = ModbusProcess::create(*config);
  if (!process) {
    spdlog::error("{}", process.error().describe());
    return EXIT_FAILURE;
  }
  const auto ran = (*process)->run(signals.get());
  if (!ran) spdlog::error("{}", ran.error().describe());
  const int code = ran ? EXIT_SUCCESS : EXIT_FAILURE;
  if (!(*process)->stop()) {
    spdlog::warn("a device keeps its thread; the process ends without it");
    std::fflush(nullptr);
    ::_exit(code);
  }
  spdlog::info("ended");
  return code;
}

int modbus_main(int argc, const char* const* argv) {
  Options options;
  CLI::App app("Maps Modbus devices into the process images of PLC instances, and images to Modbus clients.",
               "plchost-modbus");
  describe(app, options);
  try {
    app.parse(argc, argv);
    if (options.config.empty() && options.check_config.empty()) {
      throw CLI::RequiredError("--config FILE or --check-config FILE");
    }
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? EXIT_SUCCESS : kExitUsage;
  }
  return options.config.empty() ? check_only(options.check_config) : run(options);
}

}  // namespace

}  // namespace plchost::modbus

int main(int argc, char** argv) {
  plchost::MemoryGuard::watch_process();
  return plchost::modbus::modbus_main(argc, argv);
}
