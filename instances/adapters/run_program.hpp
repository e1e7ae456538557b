#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

struct ProgramEnd {
  int exit_code = 0;        ///< if `signal` is 0
  int signal = 0;           ///< that ended it
  bool over_limit = false;  ///< it ran longer than allowed, and was ended
  bool cancelled = false;   ///< it was ended because the caller wanted so
  std::string output = {};  ///< the first mebibyte of standard output and error
  [[nodiscard]] bool success() const noexcept {
    return exit_code == 0 && signal == 0 && !over_limit && !cancelled;
  }
};

struct RunLimits {
  Duration time{};                            ///< 0: no limit
  std::function<bool()> cancelled = nullptr;  ///< asked every 50 ms; may be empty
};

/// Runs a program to its end, without a shell. Its first argument is found in PATH. `folder`: where it runs.
/// The program and its children are a process group of their own. At a limit the group gets SIGTERM, and
/// after a second SIGKILL.
[[nodiscard]] Result<ProgramEnd> run_program(const std::vector<std::string>& arguments,
                                             const std::string& folder, const RunLimits& limits = {});

}  // namespace plchost
