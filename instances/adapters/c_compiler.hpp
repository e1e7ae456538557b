#pragma once

#include <string>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The words of a command as the shell, and so make, takes them: "ccache gcc", "gcc -D'A=b c'". Nothing is
/// run for it. None, or only blanks: cc. A file of the first word is absolute, as it is run elsewhere.
[[nodiscard]] Result<std::vector<std::string>> c_compiler_words(const char* cc);

/// The files to compile.
struct CompileOrder {
  std::vector<std::string> sources;
  std::vector<std::string> folders;  ///< of headers
  std::string output;
};

/// The arguments after the words of the compiler.
[[nodiscard]] std::vector<std::string> c_compiler_arguments(const CompileOrder& order);

}  // namespace plchost
