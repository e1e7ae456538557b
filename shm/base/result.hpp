#pragma once

#include <cstdint>
#include <expected>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
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

/// The same as a call that PLCHOST_TRY takes: `PLCHOST_TRY(in_step("gateway", open_node()));`. A step that
/// takes time to write, and is written for each of many, is better passed to failure_in().
template <class T>
[[nodiscard]] Result<T> in_step(std::string_view step, Result<T> result) {
  if (!result) return failure_in(step, std::move(result).error());
  return result;
}

/// `use` with the value, and its Result; or the failure. As std::expected::and_then, which GCC 12 lacks.
template <class Given, class Use>
[[nodiscard]] auto and_then(Given&& result, Use&& use) {
  if constexpr (std::is_void_v<typename std::remove_cvref_t<Given>::value_type>) {
    using Next = std::invoke_result_t<Use>;
    return result ? Next(std::invoke(std::forward<Use>(use)))
                  : Next(std::unexpect, std::forward<Given>(result).error());
  } else {
    using Next = std::invoke_result_t<Use, decltype(*std::forward<Given>(result))>;
    return result ? Next(std::invoke(std::forward<Use>(use), *std::forward<Given>(result)))
                  : Next(std::unexpect, std::forward<Given>(result).error());
  }
}

/// For what need not be there: the failure not_found becomes an empty optional, every other one stays.
/// `PLCHOST_TRY_ASSIGN(const auto event, if_found(pool.open_event(name)));`
template <class T>
[[nodiscard]] Result<std::optional<T>> if_found(Result<T> result) {
  if (result) return std::optional<T>(*std::move(result));
  if (result.error().code == ErrorCode::not_found) return std::optional<T>();
  return std::unexpected(std::move(result).error());
}

/// The same of a call without a value: whether it was there.
[[nodiscard]] Result<bool> if_found(Result<void> result);

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
