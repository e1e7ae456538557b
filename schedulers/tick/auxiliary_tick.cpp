#include "schedulers/tick/auxiliary_tick.hpp"

#include <cstdlib>

namespace plchost {

void AuxiliaryTick::start(TimePoint first, Duration period) noexcept {
  period_ = period;
  next_ = first;
  deadline_ = clock_.now() + tick_patience(period);
  if (!device_->run()) fall_back(TickFault::broken);
}

std::optional<TimePoint> AuxiliaryTick::wait() noexcept {
  while (!fallen_) {
    switch (device_->wait(deadline_)) {
      case DeviceFile::Wait::interrupted:
        return std::nullopt;
      case DeviceFile::Wait::timed_out:
        if (clock_.now() >= deadline_) fall_back(TickFault::silent);
        continue;
      case DeviceFile::Wait::readable:
        break;
    }
    const auto ticks = device_->take();
    const TimePoint now = clock_.now();
    if (!ticks) {
      fall_back(TickFault::broken);
    } else if (*ticks > 0) {
      const TimePoint tick = device_->time().planned(*ticks, now);
      next_ = tick + period_;
      deadline_ = now + tick_patience(period_);
      if (keeps_frequency(now)) return tick;
      fall_back(TickFault::off_frequency);
    } else if (now >= deadline_) {
      fall_back(TickFault::silent);
    }
  }
  return backup_->wait();
}

bool AuxiliaryTick::keeps_frequency(TimePoint now) noexcept {
  const DeviceTime& time = device_->time();
  const auto allowed =
      static_cast<Duration::rep>(static_cast<double>(time.elapsed(now).count()) * DeviceTime::kMaxDrift);
  return std::abs(time.deviation(now).count()) <= allowed + tick_patience(period_).count();
}

void AuxiliaryTick::fall_back(TickFault fault) noexcept {
  device_->halt();
  device_->fail(fault);
  fallen_ = true;
  backup_->start(next_, period_);
}

}  // namespace plchost
