#pragma once

#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// The exit code of a program that the dynamic loader could not load. None of its code has run.
inline constexpr int kExitNotLoaded = 127;

/// The transient error (see is_transient()) that a text of the dynamic loader tells. The text is that of
/// dlerror(), or the line of a program that ends with kExitNotLoaded. 0: the text tells none, so the same
/// files fail again.
[[nodiscard]] int transient_error_of_loader(std::string_view text);

/// dlopen() with these flags. On failure the message is the loader's. The error is transient if the host was
/// short of something. invalid_argument: the file, or a library that it needs, is missing or wrong.
/// refused: no program may run from the file's place. Set-up.
[[nodiscard]] Result<void*> open_library(const std::string& file, int flags);

}  // namespace plchost
