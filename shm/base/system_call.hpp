#pragma once

#include <cerrno>
#include <string>
#include <string_view>
#include <utility>

#include "shm/base/result.hpp"

namespace plchost {

/// For calls that return -1 and set errno. The result is the call's own value.
template <class Integer>
[[nodiscard]] Result<Integer> check_errno(Integer returned, std::string step) {
  if (returned == static_cast<Integer>(-1)) {
    const int error = errno;
    return failure(ErrorCode::system, std::move(step), error);
  }
  return returned;
}

/// For calls that return 0 or the error number itself (pthread_*, posix_*, clock_nanosleep).
[[nodiscard]] inline Result<void> check_returned(int returned, std::string step) {
  if (returned != 0) return failure(ErrorCode::system, std::move(step), returned);
  return {};
}

}  // namespace plchost
