#include "schedulers/distributed_clock/distributed_clock.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <utility>

namespace plchost {

namespace {

/// A stamp may be this much younger than the clock was when the task looked at it: it ended its cycle first.
constexpr Duration kStampLead = std::chrono::milliseconds(1);
constexpr int kReadAttempts = 3;

}  // namespace

DistributedClock::DistributedClock() : regulator_(settings_) {}
DistributedClock::~DistributedClock() = default;

ClockFollower& DistributedClock::add_follower(int iec_priority) {
  followers_.push_back(std::make_unique<ClockFollower>(*this, iec_priority));
  const ClockFollower& added = *followers_.back();
  if (leading_ == nullptr || iec_priority < leading_->iec_priority_) leading_ = &added;
  return *followers_.back();
}

void DistributedClock::configure(const DistributedClockSettings& settings) {
  settings_ = settings;
  regulator_ = ClockRegulator(settings);
  known_.usable = 0;
  known_.any = 0;
  known_.began = {};
  known_.left_out = ClockSilence::nothing;
  shared_.write(known_);
  for (const auto& follower : followers_) follower->begin();
}

bool DistributedClock::use_source(ReferenceSource* source) noexcept {
  constexpr int kAttempts = 20;
  constexpr auto kPause = std::chrono::microseconds(500);
  for (int attempt = 0; polling_.exchange(true, std::memory_order_acquire); ++attempt) {
    if (attempt == kAttempts) return false;
    std::this_thread::sleep_for(kPause);
  }
  source_ = source;
  polling_.store(false, std::memory_order_release);
  has_source_.store(source != nullptr, std::memory_order_release);
  active_.store(source != nullptr, std::memory_order_release);
  return true;
}

bool DistributedClock::report(const ReferencePair& pair) noexcept {
  if (has_source_.load(std::memory_order_acquire)) return false;
  if (reporting_.exchange(true, std::memory_order_acquire)) return true;
  report_.write({.pair = pair, .updates = ++reports_});
  reporting_.store(false, std::memory_order_release);
  active_.store(true, std::memory_order_release);
  return true;
}

ReferenceSource::Reading DistributedClock::reported() const noexcept {
  const auto report = report_.read(kReadAttempts);
  if (!report || report->updates == 0) return {};
  return {.outcome = ReferenceSource::Outcome::pair, .pair = report->pair, .updates = report->updates};
}

void DistributedClock::poll(TimePoint now) noexcept {
  if (polling_.exchange(true, std::memory_order_acquire)) return;
  const auto reading = source_ != nullptr ? source_->read() : reported();
  const bool first = known_.began == TimePoint{};
  if (first) known_.began = now;
  if (consume(reading, now) || first) shared_.write(known_);
  polling_.store(false, std::memory_order_release);
  last_poll_.store(now.time_since_epoch().count(), std::memory_order_relaxed);
}

// Whether there was something new.
bool DistributedClock::consume(const ReferenceSource::Reading& reading, TimePoint now) noexcept {
  switch (reading.outcome) {
    case ReferenceSource::Outcome::nothing:
      return false;
    case ReferenceSource::Outcome::corrupt:
      ++known_.rejected;
      leave_out(ClockSilence::corrupt, now);
      return true;
    case ReferenceSource::Outcome::invalid:
    case ReferenceSource::Outcome::pair:
      break;
  }
  if (std::exchange(updates_, reading.updates) == reading.updates) return false;
  if (reading.outcome == ReferenceSource::Outcome::invalid) {
    ++known_.invalid;
    leave_out(ClockSilence::invalid, now);
  } else {
    feed(reading.pair, now);
  }
  return true;
}

void DistributedClock::leave_out(ClockSilence why, TimePoint now) noexcept {
  known_.left_out = why;
  known_.left_out_at = now;
}

void DistributedClock::feed(const ReferencePair& pair, TimePoint now) noexcept {
  // Compared this way round because a stranger's stamp may lie anywhere.
  if (pair.local > now + kStampLead || pair.local < now - settings_.reference_timeout) {
    ++known_.rejected;
    leave_out(ClockSilence::other_time, now);
    return;
  }
  const bool stands_still = std::exchange(shown_ns_, pair.reference_ns) == pair.reference_ns;
  switch (regulator_.feed(pair)) {
    case ClockRegulator::Verdict::skipped:
      return;
    case ClockRegulator::Verdict::outlier:
    case ClockRegulator::Verdict::out_of_order:
    case ClockRegulator::Verdict::out_of_range:
      ++known_.rejected;
      leave_out(stands_still ? ClockSilence::stands_still : ClockSilence::no_clock, now);
      return;
    case ClockRegulator::Verdict::stepped:
      ++known_.steps;
      break;
    case ClockRegulator::Verdict::taken:
      break;
  }
  ++known_.pairs;
  known_.any = 1;
  known_.left_out = ClockSilence::nothing;
  known_.last_pair = pair.local;
  known_.model = regulator_.model();
  known_.bias_ns = regulator_.bias_ns();
  known_.usable = regulator_.usable() ? 1 : 0;
}

ClockStatus DistributedClock::status(const ClockFollower& follower) const noexcept {
  ClockStatus status;
  if (!active()) return status;
  const auto seen = shared_.read();
  if (!seen) return status;  // the processor was taken from its writer for a long time
  const TimePoint looked(Duration(last_poll_.load(std::memory_order_relaxed)));
  const Duration silent = looked - seen->last_pair;
  const bool fresh = seen->any != 0 && silent <= settings_.reference_timeout;
  const bool steering = steering_.load(std::memory_order_relaxed);
  const bool within = steering && seen->usable != 0 && follower.in_sync_.load(std::memory_order_relaxed);
  status.in_sync = within && (fresh || silent <= settings_.reference_timeout + settings_.hold_over_limit);
  if (seen->usable == 0) {
    status.state = fresh ? ClockState::acquiring : ClockState::free_running;
  } else if (!fresh) {
    status.state = ClockState::hold_over;
  } else {
    status.state = within ? ClockState::locked : ClockState::acquiring;
  }
  if (!steering && fresh) status.state = ClockState::measuring;
  const TimePoint since = seen->any != 0 ? std::max(seen->last_pair, seen->began) : seen->began;
  if (since != TimePoint{} && looked - since > settings_.reference_timeout) {
    const bool goes_on = looked - seen->left_out_at <= settings_.reference_timeout;
    status.silence = goes_on ? seen->left_out : ClockSilence::nothing;
  }
  constexpr double kPpb = 1e9;
  status.drift_ppb = std::llround(seen->model.drift * kPpb);
  status.pairs = seen->pairs;
  status.rejected = seen->rejected;
  status.invalid = seen->invalid;
  status.steps = seen->steps;
  status.offset_ns = follower.offset_ns_.load(std::memory_order_relaxed);
  status.correction_ns = follower.correction_ns_.load(std::memory_order_relaxed);
  status.correction_max_ns = follower.correction_max_ns_.load(std::memory_order_relaxed);
  status.corrections_at_bound = follower.at_bound_.load(std::memory_order_relaxed);
  return status;
}

ClockFollower::ClockFollower(DistributedClock& clock, int iec_priority) noexcept
    : clock_(clock), iec_priority_(iec_priority), sync_(clock.settings_.sync_window) {}

void ClockFollower::begin() noexcept {
  sync_ = SyncWatch(clock_.settings_.sync_window);
  known_ = {};
  in_sync_.store(false, std::memory_order_relaxed);
}

Duration ClockFollower::follow(TimePoint release, Duration interval, Duration offset,
                               TimePoint now) noexcept {
  clock_.poll(now);
  // A task of lower priority may be in the midst of writing: then the line of the last time is as good.
  if (const auto seen = clock_.shared_.read(kReadAttempts)) known_ = *seen;
  if (known_.usable == 0) return Duration::zero();
  const Duration deviation = deviation_from_grid(known_.model, release, interval, offset);
  const Duration bound = correction_bound(clock_.settings_, interval);
  const bool steering = clock_.steering_.load(std::memory_order_relaxed);
  const Duration correction = steering ? std::clamp(-deviation, -bound, bound) : Duration::zero();
  note(correction, steering && correction != -deviation);
  // The rest after the correction, and the error of the line by the pairs.
  const Duration bias(std::llround(known_.bias_ns));
  const Duration offset_left = std::clamp(deviation + correction + bias, -interval / 2, interval / 2);
  offset_ns_.store(offset_left.count(), std::memory_order_relaxed);
  in_sync_.store(sync_.record(offset_left), std::memory_order_relaxed);
  return correction;
}

void ClockFollower::note(Duration correction, bool at_bound) noexcept {
  const std::int64_t magnitude = std::abs(correction.count());
  correction_ns_.store(correction.count(), std::memory_order_relaxed);
  if (magnitude > correction_max_ns_.load(std::memory_order_relaxed)) {
    correction_max_ns_.store(magnitude, std::memory_order_relaxed);
  }
  if (at_bound) at_bound_.store(at_bound_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

}  // namespace plchost
