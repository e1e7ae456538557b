#pragma once

#include <cstdint>

#include "shm/base/result.hpp"

namespace plchost {

/// The files, found under the name, whose place the new file takes.
enum class Replaces : std::uint8_t {
  nothing,   ///< the error of `open` stays
  foreign,   ///< a file of another user, or no file at all
  anything,  ///< also a file of another kind, of another version, or damaged
};

/// Opens what several processes share, or makes it if it is not there. Processes may do so at the same time:
/// then one makes it, and the others open it. Set-up.
/// `open()`: not_found if there is none. `make(bool replace)`: gives the name last; already_exists if it is
/// taken and may not be replaced.
/// Not for a memory of the pool (ObjectPool::create_memory_into): under the pool's mutex one process makes
/// it, and each attempt would allocate all of its bytes. The headers for firmware in C have three lines of
/// their own, since they link nothing: plc_process_image.h, plc_reference_clock.h.
template <class Open, class Make>
[[nodiscard]] auto open_or_make(const Open& open, const Make& make, Replaces replaces) -> decltype(open()) {
  constexpr int kAttempts = 10;  // each one fails only if another process makes or removes it in between
  for (int attempt = 1;; ++attempt) {
    auto found = open();
    if (found) return found;
    const ErrorCode why = found.error().code;
    const bool foreign = why == ErrorCode::refused || why == ErrorCode::wrong_type;
    if (why != ErrorCode::not_found) {
      if (replaces == Replaces::anything || (replaces == Replaces::foreign && foreign)) return make(true);
      return found;
    }
    auto made = make(false);
    if (made || made.error().code != ErrorCode::already_exists || attempt == kAttempts) return made;
  }
}

}  // namespace plchost
