#pragma once

#include <string>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The exit code of a program that the dynamic loader could not load. None of its code has run.
inline constexpr int kExitNotLoaded = 127;

/// The folders in which the dynamic loader looks for libraries of this program, in their order. Set-up.
[[nodiscard]] std::vector<std::string> library_folders();

/// The error that a text of the dynamic loader tells. The text is that of dlerror(), or the line of a program
/// that ends with kExitNotLoaded. Transient (see is_transient()): the host was short of something.
/// invalid_argument: a file is missing or wrong. refused: no program may run from the place of the library.
/// If the text has no path of it, it is looked for in `folders`, and then in library_folders(). Set-up.
[[nodiscard]] Error error_of_loader(std::string text, std::vector<std::string> folders = {});

/// dlopen() with these flags. The errors are those of error_of_loader(). Set-up.
[[nodiscard]] Result<void*> open_library(const std::string& file, int flags);

}  // namespace plchost
