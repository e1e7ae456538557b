#pragma once

#include <optional>
#include <string>

#include "instances/launch/launch_contract.hpp"
#include "schedulers/tasks/priorities.hpp"

namespace plchost {

/// The order on the command line of plc-instance.
struct Options {
  LaunchOptions launch;
  std::string start_kind = "first";          ///< launch.start_kind in words
  PriorityBand band = PriorityBand::normal;  ///< launch.priority_band, translated
  std::string check_application;             ///< not empty: only check this file
  std::string check_settings;                ///< the same for a settings file
  int parent = 0;                            ///< the process whose end is that of the check, too; 0: none
  bool save_retain = false;                  ///< only write the retain memory to its files
};

/// The result of the command line: options, or the exit code of a program that has nothing more to do. That
/// is after help, version, or a usage error, whose text is printed already.
struct ParsedOptions {
  std::optional<Options> options;
  int exit_code = 0;
};

[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

}  // namespace plchost
