// Stands in the place of shm/base/futex.cpp: Linux's promises of a futex. The kernel looks at the word and
// puts the thread to sleep in one step, under a lock that a wake takes, too. So a sleep that comes after a
// wake sees all that was written before it. Nothing more is ordered by a futex here than by that lock.

#include "shm/base/futex.hpp"

#include <cstdlib>

#include "tests/models/checker/explorer.hpp"

namespace plchost {

FutexResult futex_wait(const void* word, std::uint32_t expected, TimePoint deadline) noexcept {
  using models::Explorer;
  Explorer* const scene = models::explorer();
  if (scene == nullptr || !scene->in_thread()) std::abort();
  const models::Arena::Use off(false);
  const auto address = reinterpret_cast<std::uintptr_t>(word);
  scene->step(address, true);
  scene->memory().pass_lock(scene->self(), address);
  const auto value = static_cast<std::uint32_t>(
      scene->memory().load(scene->self(), address, scene->memory().size_of(address, sizeof(std::uint32_t)),
                           models::Order::relaxed));
  scene->memory().pass_lock(scene->self(), address);
  if (value != expected) {
    scene->done("sleep is refused at", address, expected, value);
    return FutexResult::changed;
  }
  scene->done("sleeps at", address, expected, value);
  const bool timed_out = scene->sleep(address, deadline != kNoDeadline) == Explorer::Sleep::timed_out;
  scene->done(timed_out ? "has slept to its deadline at" : "is awake at", address, expected,
              timed_out ? 1 : 0);
  return timed_out ? FutexResult::timed_out : FutexResult::woken;
}

int futex_wake(const void* word, int count) noexcept {
  models::Explorer* const scene = models::explorer();
  if (scene == nullptr || !scene->in_thread()) return 0;
  const models::Arena::Use off(false);
  const auto address = reinterpret_cast<std::uintptr_t>(word);
  scene->step(address, true);
  scene->memory().pass_lock(scene->self(), address);
  const unsigned woken = scene->wake(address, static_cast<unsigned>(count));
  scene->done("wakes at", address, static_cast<std::uint64_t>(count), woken);
  return static_cast<int>(woken);
}

}  // namespace plchost
