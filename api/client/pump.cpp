#include "api/client/pump.hpp"

#include <algorithm>

namespace plchost {

void Pump::begin(Change& change) {
  if (change.hold_ == nullptr) {
    waiting_.push_back(&change);
    return;
  }
  change.hold_->change_ = &change;
  change.hold_->place_ = held_.emplace(change.deadline_, change.hold_);
}

void Pump::end(const Change& change) noexcept {
  std::erase(due_, &change);
  if (change.hold_ == nullptr) {
    std::erase(waiting_, &change);
  } else if (change.hold_->change_ == &change) {
    held_.erase(change.hold_->place_);
    change.hold_->change_ = nullptr;
  }
}

void Pump::release(Hold& hold) {
  held_.erase(hold.place_);
  due_.push_back(std::exchange(hold.change_, nullptr));
}

void Pump::release_overdue() {
  if (held_.empty()) return;
  const TimePoint now = MonotonicClock::now();
  while (!held_.empty() && held_.begin()->first <= now) release(*held_.begin()->second);
}

void Pump::round(TimePoint deadline) {
  if (rounds_ == 0 || due_.empty()) {  // else an operation of this round runs another one to its end
    for (const Change* const change : waiting_) deadline = std::min(deadline, change->deadline_);
    if (!held_.empty()) deadline = std::min(deadline, held_.begin()->first);
    if (std::exchange(again_, false) || !due_.empty()) deadline = TimePoint{};
    set_.wait(deadline);
    take_(waiting_.size() > 1);
    due_.insert(due_.end(), waiting_.begin(), waiting_.end());
    waiting_.clear();
    release_overdue();
  }
  ++rounds_;
  while (!due_.empty()) {
    Change* const change = due_.front();
    due_.pop_front();
    std::exchange(change->handle_, {}).resume();
  }
  --rounds_;
}

}  // namespace plchost
