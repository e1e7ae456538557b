#include "shm/base/result.hpp"

#include <cstring>
#include <utility>

namespace plchost {

std::string_view to_string(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::ok:
      return "ok";
    case ErrorCode::invalid_argument:
      return "invalid argument";
    case ErrorCode::not_found:
      return "not found";
    case ErrorCode::already_exists:
      return "already exists";
    case ErrorCode::wrong_state:
      return "wrong state";
    case ErrorCode::refused:
      return "refused";
    case ErrorCode::busy:
      return "busy";
    case ErrorCode::timed_out:
      return "timed out";
    case ErrorCode::unavailable:
      return "unavailable";
    case ErrorCode::system:
      return "failed";
    case ErrorCode::unsupported:
      return "unsupported";
    case ErrorCode::full:
      return "full";
    case ErrorCode::corrupt:
      return "corrupt";
    case ErrorCode::wrong_type:
      return "wrong type";
    case ErrorCode::wrong_size:
      return "wrong size";
  }
  return "unknown";
}

std::string Error::describe() const {
  if (system_errno == 0) return message;
  const char* text = strerrordesc_np(system_errno);
  const char* name = strerrorname_np(system_errno);
  return message + ": " + (text != nullptr ? text : "unknown error") + " (" + (name != nullptr ? name : "?") +
         ")";
}

std::unexpected<Error> failure(ErrorCode code, std::string message, int system_errno) {
  return std::unexpected(Error{code, system_errno, std::move(message)});
}

std::unexpected<Error> failure_in(std::string_view step, Error error) {
  error.message = std::string(step) + ": " + error.message;
  return std::unexpected(std::move(error));
}

Result<bool> if_found(Result<void> result) {
  if (!result && result.error().code != ErrorCode::not_found) {
    return std::unexpected(std::move(result).error());
  }
  return result.has_value();
}

}  // namespace plchost
