#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

struct ProgramEnd {
  int exit_code = 0;   ///< if `signal` is 0
  int signal = 0;      ///< that ended it
  std::string output;  ///< the first mebibyte of standard output and error
  [[nodiscard]] bool success() const noexcept { return exit_code == 0 && signal == 0; }
};

/// Runs a program to its end, without a shell. Its first argument is found in PATH. `folder`: where it runs.
[[nodiscard]] Result<ProgramEnd> run_program(const std::vector<std::string>& arguments,
                                             const std::string& folder);

}  // namespace plchost
