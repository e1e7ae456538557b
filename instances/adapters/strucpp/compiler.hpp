#pragma once

#include <string>

#include "shm/base/result.hpp"

namespace plchost::strucpp {

/// A STruC++ that can be used.
struct Compiler {
  std::string folder;   ///< with dist/node/index.js and its libs
  std::string headers;  ///< folder of its headers for C++ (iec_std_lib.hpp)
};

/// Looks in `folder` (of a built STruC++); empty: where PLCHOST_STRUCPP says, else where the program strucpp
/// in PATH leads. not_found: the error says how to get one.
[[nodiscard]] Result<Compiler> find_compiler(const std::string& folder);

}  // namespace plchost::strucpp
