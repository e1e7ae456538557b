#pragma once

#include <cstdint>

#include "shm/base/time.hpp"

namespace plchost {

/// A server whose presence has been missing for so long is gone.
inline constexpr Duration kServerGone = std::chrono::milliseconds(500);

/// Which server of a host counts: the one of the greatest epoch, while its presence arrives. The last samples
/// of one that was replaced do not; one whose clock was set back does, once the one before it is gone.
class NewestEpoch {
 public:
  /// Whether what has come with this epoch counts.
  [[nodiscard]] bool accept(std::uint64_t epoch, TimePoint now) noexcept {
    if (epoch < value_ && !is_gone(now)) return false;
    value_ = epoch;
    last_ = now;
    return true;
  }
  /// 0: none yet.
  [[nodiscard]] std::uint64_t value() const noexcept { return value_; }
  /// When something that counts has come last.
  [[nodiscard]] TimePoint last() const noexcept { return last_; }
  /// Whether that is so long ago that the server is gone.
  [[nodiscard]] bool is_gone(TimePoint now) const noexcept { return now - last_ > kServerGone; }

 private:
  std::uint64_t value_ = 0;
  TimePoint last_;
};

}  // namespace plchost
