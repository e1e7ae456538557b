#pragma once

#include <string>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The words of a command as the shell, and so make, takes them: "ccache gcc", "gcc -D'A=b c'". Nothing is
/// run for it. None, or only blanks: `usual`. A file of the first word is absolute, as it is run elsewhere.
/// `variable`: of the environment, for messages.
[[nodiscard]] Result<std::vector<std::string>> c_compiler_words(const char* command,
                                                                const char* variable = "CC",
                                                                const char* usual = "cc");

/// The files to compile.
struct CompileOrder {
  enum class Kind : unsigned char {
    c_application,
    c_objects,  ///< into the folder in which it runs, each by the name of its source
    cpp_application,
  };
  Kind kind = Kind::c_application;
  std::vector<std::string> sources;     ///< of an application in C++ also objects
  std::vector<std::string> folders;     ///< of headers
  std::string output;                   ///< not of objects
  std::vector<std::string> flags = {};  ///< further ones
};

/// The arguments after the words of the compiler.
[[nodiscard]] std::vector<std::string> c_compiler_arguments(const CompileOrder& order);

}  // namespace plchost
