#include "api/client/pump.hpp"

#include <algorithm>

namespace plchost {

void Pump::remove(const Change& change) noexcept {
  std::erase(waiting_, &change);
  std::erase(due_, &change);
}

void Pump::round(TimePoint deadline) {
  if (due_.empty()) {  // else an operation of this round runs another one to its end
    for (const Change* const change : waiting_) deadline = std::min(deadline, change->deadline_);
    if (std::exchange(again_, false)) deadline = TimePoint{};
    set_.wait(deadline);
    take_(waiting_.size() > 1);
    due_ = std::exchange(waiting_, {});
  }
  while (!due_.empty()) {
    Change* const change = due_.front();
    due_.pop_front();
    std::exchange(change->handle_, {}).resume();
  }
}

}  // namespace plchost
