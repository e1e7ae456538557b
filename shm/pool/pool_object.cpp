#include "shm/pool/pool_object.hpp"

#include <algorithm>

#include "shm/pool/pool_segment.hpp"

namespace plchost {

namespace {

// One that is killed between its post and its wake has left the post: a waiter looks for it so often.
constexpr Duration kLook = std::chrono::milliseconds(40);
// A waiter without a mark is not woken, so it polls each millisecond.
constexpr Duration kUnmarkedLook = std::chrono::milliseconds(1);

// A waiter without a limit looks every 200 ms whether the object is still there.
TimePoint next_look(TimePoint deadline) noexcept {
  constexpr Duration kInterval = std::chrono::milliseconds(200);
  return std::min(deadline, MonotonicClock::now() + kInterval);
}

ObjectStatus status_of(LockResult result) noexcept {
  switch (result) {
    case LockResult::locked:
      return ObjectStatus::done;
    case LockResult::owner_died:
      return ObjectStatus::owner_died;
    case LockResult::timed_out:
      return ObjectStatus::timed_out;
    case LockResult::deadlock:
      return ObjectStatus::deadlock;
    case LockResult::corrupt:
      break;
  }
  return ObjectStatus::corrupt;
}

}  // namespace

PoolObject::Waiting::Waiting(const PoolObject& object) noexcept : reference_(object.reference_) {
  if (reference_ != nullptr) reference_->waiting.fetch_add(1, std::memory_order_relaxed);
}

PoolObject::Waiting::~Waiting() {
  if (reference_ != nullptr) reference_->waiting.fetch_sub(1, std::memory_order_relaxed);
}

void PoolObject::swap(PoolObject& other) noexcept {
  std::swap(segment_, other.segment_);
  std::swap(entry_, other.entry_);
  std::swap(reference_, other.reference_);
  std::swap(generation_, other.generation_);
  std::swap(reference_generation_, other.reference_generation_);
  std::swap(writable_, other.writable_);
}

void PoolObject::close() noexcept {
  if (reference_ != nullptr) segment_->release(*reference_, reference_generation_);
  reference_ = nullptr;
  entry_ = nullptr;
  writable_ = false;
  segment_.reset();
}

bool PoolObject::across() const noexcept {
  return segment_->across_containers();
}

PoolMutex PoolObject::mutex() const noexcept {
  return segment_->mutex(entry_->mutex);
}

ObjectStatus PoolObject::why_not_valid() const noexcept {
  return segment_ != nullptr && segment_->lost() ? ObjectStatus::corrupt : ObjectStatus::gone;
}

std::uint64_t SharedEvent::count() const noexcept {
  if (!valid()) return 0;
  const std::uint64_t since = entry().event.count() - entry().first_count.load(std::memory_order_relaxed);
  return since & CountedEvent::kCountMask;
}

// Also with the right to read only: to wait is to mark the event, which costs its poster a wake, or, where
// nothing can be marked, to look.
ObjectStatus SharedEvent::wait(std::uint64_t& cursor, TimePoint deadline) const noexcept {
  const std::uint64_t before = cursor;
  if (before > CountedEvent::kCountMask) return ObjectStatus::bad_cursor;
  const Waiting waiting(*this);
  for (;;) {
    if (!valid()) return why_not_valid();
    const auto seen = entry().event.snapshot();
    const std::uint64_t posts = count();
    if (!valid()) return why_not_valid();
    // The count goes round.
    const std::uint64_t missed = (posts - before) & CountedEvent::kCountMask;
    if (missed > CountedEvent::kCountMask / 2) return ObjectStatus::bad_cursor;
    if (missed != 0) {
      cursor = posts;
      return ObjectStatus::done;
    }
    const TimePoint now = MonotonicClock::now();
    if (now >= deadline) return ObjectStatus::timed_out;
    if (can_be_marked()) {
      entry().event.wait(seen, std::min(deadline, now + kLook));
    } else {
      entry().event.wait_unmarked(seen, std::min(deadline, now + kUnmarkedLook));
    }
  }
}

PoolEvent SharedEvent::event() const noexcept {
  return valid() ? PoolEvent(entry()) : PoolEvent();
}

ObjectStatus SharedSemaphore::post() const noexcept {
  if (const ObjectStatus now = usable(); now != ObjectStatus::done) return now;
  return entry().semaphore.post() ? ObjectStatus::done : ObjectStatus::full;
}

ObjectStatus SharedSemaphore::try_wait() const noexcept {
  if (const ObjectStatus now = usable(); now != ObjectStatus::done) return now;
  return entry().semaphore.try_wait() ? ObjectStatus::done : ObjectStatus::timed_out;
}

ObjectStatus SharedSemaphore::wait(TimePoint deadline) const noexcept {
  if (const ObjectStatus at_once = try_wait(); at_once != ObjectStatus::timed_out) return at_once;
  const Waiting waiting(*this);
  for (;;) {
    const TimePoint until = next_look(deadline);
    if (entry().semaphore.wait(until)) return ObjectStatus::done;
    if (!valid()) return why_not_valid();
    if (until == deadline) return ObjectStatus::timed_out;
  }
}

std::uint32_t SharedSemaphore::value() const noexcept {
  return valid() ? entry().semaphore.value() : 0;
}

ObjectStatus SharedMutex::try_lock() const noexcept {
  if (const ObjectStatus now = usable(); now != ObjectStatus::done) return now;
  return status_of(across() ? mutex().try_lock() : entry().mutex.try_lock());
}

ObjectStatus SharedMutex::lock(TimePoint deadline) const noexcept {
  if (const ObjectStatus at_once = try_lock(); at_once != ObjectStatus::timed_out) return at_once;
  const Waiting waiting(*this);
  for (;;) {
    const TimePoint until = next_look(deadline);
    const LockResult result = across() ? mutex().lock(until) : entry().mutex.lock(until);
    if (result != LockResult::timed_out) return status_of(result);
    if (!valid()) return why_not_valid();
    if (until == deadline) return ObjectStatus::timed_out;
  }
}

ObjectStatus SharedMutex::unlock() const noexcept {
  if (const ObjectStatus now = usable(); now != ObjectStatus::done) return now;
  const bool done = across() ? mutex().unlock() : entry().mutex.unlock();
  return done ? ObjectStatus::done : ObjectStatus::not_owner;
}

std::uint32_t SharedMutex::owner() const noexcept {
  return valid() ? mutex().thread() : 0;
}

}  // namespace plchost
