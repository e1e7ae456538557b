#include "shm/threads/client_mutex.hpp"

#include <algorithm>

namespace plchost {

namespace {

constexpr std::uint32_t kSomebodyWaits = 1U << 31U;
/// In the place of a client's number: the thread that held the mutex has ended, and its process goes on.
constexpr std::uint32_t kAbandoned = kSomebodyWaits - 1;
static_assert(ClientMutex::kMaxClient < kAbandoned);

constexpr std::uint32_t client_of(std::uint32_t word) noexcept {
  return word & ~kSomebodyWaits;
}

constexpr std::uint64_t record_for(const ClientThread& thread) noexcept {
  return std::uint64_t{thread.client} << 32U | thread.thread;
}

}  // namespace

// The record is written after the word. It is compared with the caller's own only, which the caller itself
// has written, if anybody has.
LockResult ClientMutex::try_lock(const ClientThread& self) noexcept {
  std::uint32_t found = 0;
  if (word_.compare_exchange_strong(found, self.client, std::memory_order_acquire,
                                    std::memory_order_relaxed)) {
    record_.store(record_for(self), std::memory_order_relaxed);
    return LockResult::locked;
  }
  const bool ours =
      client_of(found) == self.client && record_.load(std::memory_order_relaxed) == record_for(self);
  return ours ? LockResult::deadlock : LockResult::timed_out;
}

// Only if it is still as it was seen. Others may wait, also if the word does not say so: one that was woken
// has taken the mark away with it.
bool ClientMutex::take(std::uint32_t word, const ClientThread& self) noexcept {
  if (!word_.compare_exchange_strong(word, self.client | kSomebodyWaits, std::memory_order_acquire,
                                     std::memory_order_relaxed)) {
    return false;
  }
  record_.store(record_for(self), std::memory_order_relaxed);
  return true;
}

LockResult ClientMutex::lock(const ClientThread& self, const ClientRoll& roll, TimePoint deadline) noexcept {
  const LockResult at_once = try_lock(self);
  if (at_once != LockResult::timed_out) return at_once;
  for (;;) {
    std::uint32_t word = word_.load(std::memory_order_relaxed);
    const std::uint32_t owner = client_of(word);
    if (owner == 0) {
      if (take(word, self)) return LockResult::locked;
      continue;
    }
    if (owner == kAbandoned || !roll.lives(owner)) {
      if (take(word, self)) return LockResult::owner_died;
      continue;
    }
    // Also by one that gives up now: it may have been woken in the place of another one.
    if ((word & kSomebodyWaits) == 0) {
      if (!word_.compare_exchange_strong(word, word | kSomebodyWaits, std::memory_order_relaxed)) continue;
      word |= kSomebodyWaits;
    }
    const TimePoint now = MonotonicClock::now();
    if (now >= deadline) return LockResult::timed_out;
    (void)futex_wait(&word_, word, std::min(deadline, now + RobustMutex::kLook));
  }
}

// Not by a plain store: if this process was taken for ended, it is another one's by now.
bool ClientMutex::unlock(const ClientThread& self) noexcept {
  std::uint32_t word = word_.load(std::memory_order_relaxed);
  if (client_of(word) != self.client) return false;
  if (record_.load(std::memory_order_relaxed) != record_for(self)) return false;
  record_.store(0, std::memory_order_relaxed);
  while (!word_.compare_exchange_weak(word, 0, std::memory_order_release, std::memory_order_relaxed)) {
    if (client_of(word) != self.client) return false;
  }
  if ((word & kSomebodyWaits) != 0) (void)futex_wake(&word_, 1);
  return true;
}

void ClientMutex::abandon(const ClientThread& self) noexcept {
  std::uint32_t word = word_.load(std::memory_order_relaxed);
  if (client_of(word) != self.client || record_.load(std::memory_order_relaxed) != record_for(self)) return;
  record_.store(0, std::memory_order_relaxed);  // the next thread of this number did not lock it
  while (!word_.compare_exchange_weak(word, kAbandoned | (word & kSomebodyWaits), std::memory_order_release,
                                      std::memory_order_relaxed)) {
    if (client_of(word) != self.client) return;
  }
  if ((word & kSomebodyWaits) != 0) (void)futex_wake(&word_, 1);
}

std::uint32_t ClientMutex::client() const noexcept {
  return client_of(word_.load(std::memory_order_relaxed));
}

std::uint32_t ClientMutex::thread() const noexcept {
  const std::uint32_t owner = client();
  const std::uint64_t record = record_.load(std::memory_order_relaxed);
  return owner != 0 && record >> 32U == owner ? static_cast<std::uint32_t>(record) : 0;
}

bool ClientMutex::owner_has_ended(const ClientRoll& roll) const noexcept {
  const std::uint32_t owner = client();
  return owner == kAbandoned || (owner != 0 && !roll.lives(owner));
}

}  // namespace plchost
