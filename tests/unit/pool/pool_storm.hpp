#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_view.hpp"
#include "tests/unit/pool/pool_invariants.hpp"

namespace plchost {

/// The calls of a client that is killed in the midst of one: all kinds of calls, in a random order.
[[noreturn]] inline void storm(const std::string& name, unsigned seed) {
  auto pool = std::move(ObjectPool::attach(name).value());
  const auto shared = [&](const char* kind) { return kind + std::to_string(seed++ * 7 % 5); };
  for (;;) {
    const auto soon = [] { return MonotonicClock::now() + std::chrono::microseconds(50); };
    if (const auto memory = pool.create_memory(shared("memory"), 4096, {.keep = seed % 11 == 0})) {
      memory->object.bytes()[seed % 4096] = std::byte{1};
    }
    if (const auto mutex = pool.create_mutex(shared("mutex"))) {
      const ObjectStatus locked = mutex->object.lock(soon());
      const bool ours = locked == ObjectStatus::done || locked == ObjectStatus::owner_died;
      if (ours && seed % 3 != 0) (void)mutex->object.unlock();
    }
    if (const auto semaphore = pool.create_semaphore(shared("semaphore"), 1)) {
      if (semaphore->object.wait(soon()) == ObjectStatus::done) (void)semaphore->object.post();
    }
    if (const auto event = pool.create_shared_event(shared("event"))) {
      std::uint64_t cursor = event->object.count();
      (void)event->object.post();
      (void)event->object.wait(cursor, soon());
    }
    (void)pool.remove_object(shared("memory"));
    if (seed % 13 == 0) (void)pool.list();
  }
}

/// All storms on the pool were killed, and the test holds "mutex0": nothing is held by the dead, and each
/// kept memory has its file and no other one has.
inline void expect_whole_after_a_storm(const std::string& name, ObjectPool& pool, const PoolView& view) {
  std::size_t memories = 0;
  for (const auto all = pool.list().value(); const ObjectInfo& info : all) {
    const bool ours = info.name == "mutex0";
    ASSERT_TRUE(info.kept || ours) << info.name;
    ASSERT_EQ(info.references.size(), ours ? 1U : 0U) << info.name;
    ASSERT_EQ(info.waiters, 0U) << info.name;
    if (info.type != ObjectType::memory) continue;
    ++memories;
    ASSERT_TRUE(pool.open_memory(info.name)) << info.name;
  }
  ASSERT_EQ(damage_of(view), "");
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator("/dev/shm")) {
    if (file.path().filename().string().starts_with(name + ".memory.")) ++files;
  }
  ASSERT_EQ(files, memories);
}

}  // namespace plchost
