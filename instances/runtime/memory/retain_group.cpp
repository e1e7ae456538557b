#include "instances/runtime/memory/retain_group.hpp"

#include <chrono>
#include <thread>

namespace plchost {

__attribute__((no_sanitize("thread"))) void copy_moving(std::byte* to, const std::byte* from,
                                                        std::size_t bytes) noexcept {
  std::size_t at = 0;
  for (; at + sizeof(std::uint64_t) <= bytes; at += sizeof(std::uint64_t)) {
    const std::uint64_t word = *reinterpret_cast<const volatile std::uint64_t*>(from + at);
    *reinterpret_cast<std::uint64_t*>(to + at) = word;
  }
  for (; at < bytes; ++at) to[at] = *const_cast<const volatile std::byte*>(from + at);
}

void RetainGroup::ask(std::span<std::byte> copy) noexcept {
  copy_ = copy;
  state_.store(State::asked, std::memory_order_release);
}

bool RetainGroup::begin_copy() noexcept {
  State asked = State::asked;
  return state_.compare_exchange_strong(asked, State::copying, std::memory_order_acquire,
                                        std::memory_order_relaxed);
}

void RetainGroup::end_copy(bool done) noexcept {
  state_.store(done ? State::done : State::asked, std::memory_order_release);
}

// No task may begin a cycle meanwhile: each counter is even, and the sum of all, which only grow, is the same
// after the copy.
bool RetainGroup::copy() const noexcept {
  std::uint64_t before = 0;
  for (const CycleCounter* const counter : counters_) {
    const std::uint64_t count = counter->load(std::memory_order_acquire);  // pairs with the end of a cycle
    if (count % 2 != 0) return false;
    before += count;
  }
  for (const Part& part : parts_) copy_moving(copy_.data() + part.offset, part.live.data(), part.live.size());
  // Pairs with the release fence at the start of a cycle: its writes are seen after its odd count.
  std::atomic_thread_fence(std::memory_order_acquire);
  std::uint64_t after = 0;
  for (const CycleCounter* const counter : counters_) after += counter->load(std::memory_order_relaxed);
  return after == before;
}

bool RetainGroup::is_answered() noexcept {
  if (begin_copy()) end_copy(copy());
  return state_.load(std::memory_order_acquire) == State::done;
}

bool RetainGroup::withdraw() noexcept {
  for (;;) {
    State asked = State::asked;
    if (state_.compare_exchange_strong(asked, State::idle, std::memory_order_acquire)) return false;
    if (asked == State::idle) return false;
    if (asked == State::done) {
      state_.store(State::idle, std::memory_order_relaxed);
      return true;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(100));  // a task is at it
  }
}

// A task of higher priority may run through a cycle while this one copies: then again.
void RetainGroup::answer_now(bool may_wait) noexcept {
  constexpr int kAttempts = 3;
  constexpr int kPatientAttempts = 20;
  for (int attempt = 0; attempt < (may_wait ? kPatientAttempts : kAttempts); ++attempt) {
    if (attempt > 0 && may_wait) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (!begin_copy()) return;  // another one is at it, or it was done
    const bool done = copy();
    end_copy(done);
    if (done) return;
  }
}

}  // namespace plchost
