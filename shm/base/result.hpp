#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <string_view>
#include <utility>

namespace plchost {

/// The kind of a failure, so that callers can decide without reading text. The numbers travel in control
/// messages and in the DDS API: they are never reused.
enum class ErrorCode : std::uint8_t {
  ok = 0,
  invalid_argument = 1,  ///< a name, value or file is not of the allowed form
  not_found = 2,         ///< the named thing does not exist
  already_exists = 3,
  wrong_state = 4,  ///< exists, but cannot do this now (stop what is stopped)
  refused = 5,      ///< not permitted (by configuration or by the system)
  busy = 6,         ///< a bound was hit; try again later
  timed_out = 7,
  unavailable = 8,   ///< the other process is not there
  system = 9,        ///< a system call failed; see system_errno
  unsupported = 10,  ///< known, and not possible here
  full = 11,         ///< a table or the pool has no room
  corrupt = 12,      ///< data in a file, message or shared memory is not valid
  wrong_type = 13,   ///< there is an object of that name, of another type
  wrong_size = 14,   ///< there is a memory of that name, of another size
};

[[nodiscard]] std::string_view to_string(ErrorCode code) noexcept;

/// A failure on the set-up path. The message names what was attempted, on what, and what to change.
struct Error {
  ErrorCode code = ErrorCode::system;
  int system_errno = 0;
  std::string message;

  /// The message, followed by the text of system_errno if there is one.
  [[nodiscard]] std::string describe() const;
};

template <class T>
using Result = std::expected<T, Error>;

/// Makes the failing arm of a Result: `return failure(ErrorCode::not_found, "no instance 'x'");`
[[nodiscard]] std::unexpected<Error> failure(ErrorCode code, std::string message, int system_errno = 0);

/// Passes another function's failure on, with the step that it happened in put before its message.
[[nodiscard]] std::unexpected<Error> failure_in(std::string_view step, Error error);

}  // namespace plchost

// Two macros, as in Abseil: a TRY with a value, as in SerenityOS, needs an extension of GCC. With one name
// for both, as in Boost.Outcome, a comma between template arguments ends the declaration.

/// Evaluates a call that returns a Result, once. If the call fails, the enclosing function returns its error,
/// unchanged. A value is dropped, so use no call that returns a lock: `PLCHOST_TRY(check_name(name));`
#define PLCHOST_TRY(...) PLCHOST_TRY_AS(PLCHOST_TRY_JOIN(plchost_try_, __COUNTER__), __VA_ARGS__)

/// As PLCHOST_TRY, and puts the value into a new variable or into one that exists:
/// `PLCHOST_TRY_ASSIGN(const auto file, open(path));` or `PLCHOST_TRY_ASSIGN(file_, open(path));`.
/// It is two statements. After an `if` it needs braces, and does not compile without them.
#define PLCHOST_TRY_ASSIGN(variable, ...) \
  PLCHOST_TRY_ASSIGN_AS(PLCHOST_TRY_JOIN(plchost_try_, __COUNTER__), variable, __VA_ARGS__)

// The counted name lets a lambda in the call contain another one.
#define PLCHOST_TRY_JOIN(name, number) PLCHOST_TRY_JOIN_EXPANDED(name, number)
#define PLCHOST_TRY_JOIN_EXPANDED(name, number) name##number

#define PLCHOST_TRY_AS(result, ...)                                           \
  do {                                                                        \
    if (auto&& result = (__VA_ARGS__); !result)                               \
      return std::unexpected(std::forward<decltype(result)>(result).error()); \
  } while (false)

#define PLCHOST_TRY_ASSIGN_AS(result, variable, ...)                                   \
  auto&& result = (__VA_ARGS__);                                                       \
  if (!result) return std::unexpected(std::forward<decltype(result)>(result).error()); \
  variable = *std::forward<decltype(result)>(result)
