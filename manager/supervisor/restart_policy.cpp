#include "manager/supervisor/restart_policy.hpp"

#include <algorithm>

namespace plchost {

void RestartHistory::record_end(TimePoint now, Duration lasted, bool crash) {
  // Who stayed up for a whole window has recovered.
  if (lasted >= config_.crash_window) in_a_row_ = 0;
  ++in_a_row_;
  if (crash) crashes_.push_back(now);
  while (!crashes_.empty() && now - crashes_.front() > config_.crash_window) crashes_.pop_front();
  while (crashes_.size() > config_.crash_limit) crashes_.pop_front();
}

void RestartHistory::restore(TimePoint now, const std::vector<Duration>& ages, std::uint32_t in_a_row) {
  in_a_row_ = in_a_row;
  crashes_.clear();
  for (const Duration age : ages) {
    // A clock that was set back makes an age negative: then the crash is a young one.
    if (age <= config_.crash_window) crashes_.push_back(now - std::max(age, Duration::zero()));
  }
  while (crashes_.size() > config_.crash_limit) crashes_.pop_front();
}

void RestartHistory::forget() noexcept {
  crashes_.clear();
  in_a_row_ = 0;
}

Duration RestartHistory::delay() const noexcept {
  constexpr std::uint32_t kMostDoublings = 20;  // far beyond any allowed ratio of the two delays
  const std::uint32_t doublings = in_a_row_ == 0 ? 0 : std::min(in_a_row_ - 1, kMostDoublings);
  return std::min(config_.restart_delay_max, config_.restart_delay * (std::int64_t{1} << doublings));
}

}  // namespace plchost
