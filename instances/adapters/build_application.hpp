#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "instances/adapters/iec/source_place.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The words for BuildOrder::compiler.
inline constexpr std::array kCompilers{"matiec", "strucpp"};

/// The order to `plcctl build application`.
struct BuildOrder {
  std::vector<std::string> sources;  ///< files (ST, or PLCopen XML), and folders: their *.st, at any depth
  /// Task file; empty: of a single source X.st, or folder X, X.toml beside it; also tasks.toml in the folder.
  std::string tasks = {};
  std::string output;  ///< the application: line.so. Of several resources each has its name in it
  std::string compiler =
      {};                    ///< of kCompilers; empty: the one of which the folder is named, or that is there
  std::string matiec;        ///< folder of that compiler; empty: PLCHOST_MATIEC, PATH
  std::string strucpp = {};  ///< folder of that compiler; empty: PLCHOST_STRUCPP, PATH
  std::string adapters;      ///< folder of plc_app.h and of the adapters' files
  bool debug = false;        ///< tasks can halt at each statement: see plc_debug.h
  std::string keep;          ///< folder in which the files between are left (see WorkFolder); empty: nowhere
  std::string check_program;  ///< plc-instance; empty: the application is not checked
  Duration translate_limit = std::chrono::seconds(120);  ///< of iec2c or STruC++, and of the check
  Duration compile_limit = std::chrono::seconds(600);    ///< of the C and C++ compilers
  std::function<bool()> cancelled = nullptr;  ///< asked every 50 ms: the build ends, nothing is left
};

struct BuildReport {
  std::vector<std::string> applications;  ///< that were made: all, or none
  iec::SourceProblems problems;           ///< if there are any, all files are as they were before
  iec::SourceProblems remarks;
};

/// From Structured Text to applications. Runs the compilers, which may take minutes. Set-up.
[[nodiscard]] BuildReport build_application(const BuildOrder& order);

}  // namespace plchost
