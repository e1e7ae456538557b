#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_journal.hpp"
#include "shm/pool/pool_layout.hpp"
#include "tests/unit/pool/create_patiently.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

constexpr auto kReadWrite = MemoryFile::Access::read_write;

template <class Body>
pid_t in_child(Body body) {
  const pid_t child = ::fork();
  if (child == 0) {
    body();
    ::_exit(0);
  }
  return child;
}

int wait_for(pid_t child) {
  int status = -1;
  ::waitpid(child, &status, 0);
  return status;
}

void kill_and_reap(pid_t child) {
  ::kill(child, SIGKILL);
  wait_for(child);
}

class PoolCrash : public testing::Test {
 protected:
  ObjectPool create(std::uint32_t max_objects) {
    auto pool = ObjectPool::create(name_.get(), {.max_objects = max_objects});
    EXPECT_TRUE(pool) << pool.error().describe();
    return std::move(pool.value());
  }
  [[nodiscard]] MemoryFile map() const {
    return std::move(MemoryFile::open(name_.get(), 1, kReadWrite).value());
  }
  static PoolHeader& header_of(const MemoryFile& memory) {
    return *reinterpret_cast<PoolHeader*>(memory.bytes().data());
  }
  static ObjectEntry* entries_of(const MemoryFile& memory, std::uint32_t max_objects) {
    return reinterpret_cast<ObjectEntry*>(memory.bytes().data() + entries_offset(max_objects));
  }
  UniquePoolName name_;
};

TEST_F(PoolCrash, SeveralProcessesCreateTheSamePoolAtOnce) {
  for (int round = 0; round < 20; ++round) {
    std::vector<pid_t> children;
    for (int i = 0; i < 4; ++i) {
      children.push_back(in_child([&] {
        auto pool = ObjectPool::create(name_.get(), {.max_objects = 64});
        const auto event =
            pool ? create_patiently(*pool, "child" + std::to_string(i)) : std::unexpected(pool.error());
        if (!event) ::_exit(1);
        event->set_registered(true);
      }));
    }
    for (const pid_t child : children) EXPECT_EQ(wait_for(child), 0);
    EXPECT_EQ(ObjectPool::attach(name_.get())->list()->size(), children.size());
    ObjectPool::remove(name_.get());
  }
}

TEST_F(PoolCrash, ACreatorThatIsKilledLeavesNothingHalfMade) {
  for (int round = 0; round < 30; ++round) {
    const pid_t child = in_child([&] {
      for (;;) {
        (void)ObjectPool::create(name_.get(), {.max_objects = 20'000});
        ObjectPool::remove(name_.get());
      }
    });
    std::this_thread::sleep_for(std::chrono::microseconds(500 + 137 * round));
    kill_and_reap(child);
    auto sut = ObjectPool::create(name_.get(), {.max_objects = 20'000});
    ASSERT_TRUE(sut) << sut.error().describe();
    ASSERT_TRUE(sut->create_event("a"));
  }
}

TEST_F(PoolCrash, APoolThatItsMakerNeverCompletedIsReplaced) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{8}, pool_size(64)}) {
    std::ofstream("/dev/shm/" + name_.get()) << std::string(size, '\0');
    if (size == 0) {
      EXPECT_EQ(ObjectPool::attach(name_.get()).error().code, ErrorCode::corrupt);
    }
    auto sut = ObjectPool::create(name_.get(), {.max_objects = 64});
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_TRUE(sut->create_event("a"));
    ObjectPool::remove(name_.get());
  }
}

TEST_F(PoolCrash, AttachWaitsForAPoolThatIsBeingMade) {
  create(64);
  const MemoryFile memory = map();
  for (bool late = true; late;) {
    header_of(memory).magic.store(0);
    header_of(memory).magic_again.store(0);
    const TimePoint begun = MonotonicClock::now();
    std::atomic<TimePoint> made{};
    std::thread maker([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      header_of(memory).magic.store(kPoolMagic, std::memory_order_release);
      made = MonotonicClock::now();
    });
    const bool attached = ObjectPool::attach(name_.get()).has_value();
    maker.join();
    late = !attached && made.load() - begun > std::chrono::milliseconds(80);  // than anybody waits
    EXPECT_TRUE(attached || late);
  }
}

/// One that is killed with the lock held, in the middle of what `change` does.
template <class Change>
void die_in_the_midst(const MemoryFile& memory, Change change) {
  std::array<int, 2> locked{};
  ASSERT_EQ(::pipe(locked.data()), 0);
  const pid_t child = in_child([&] {
    auto& header = *reinterpret_cast<PoolHeader*>(memory.bytes().data());
    (void)header.mutex.lock();
    PoolJournal journal(header, memory.bytes().size());
    change(header, journal);
    (void)!::write(locked[1], "x", 1);
    for (;;) ::pause();
  });
  char byte = 0;
  EXPECT_EQ(::read(locked[0], &byte, 1), 1);
  kill_and_reap(child);
  ::close(locked[0]);
  ::close(locked[1]);
}

TEST_F(PoolCrash, WhatTheOwnerOfTheMutexHadBegunIsUndoneWhenItWasKilled) {
  auto sut = create(64);
  sut.create_event("kept")->set_registered(true);
  const MemoryFile memory = map();
  die_in_the_midst(memory, [&](PoolHeader& header, PoolJournal& journal) {
    for (std::uint32_t i = 0; i < bucket_count_for(64) / 2; ++i) {
      auto* const buckets = reinterpret_cast<Link*>(memory.bytes().data() + buckets_offset(64));
      journal.set(buckets[i], 0);
    }
    journal.set(header.high_water, 0);
    journal.set(header.high_water, 7);
  });
  EXPECT_TRUE(sut.open_event("kept"));
  EXPECT_EQ(header_of(memory).repairs.load(), 1U);
  EXPECT_EQ(header_of(memory).rebuilds.load(), 0U);
  EXPECT_EQ(header_of(memory).high_water.load(), 1U);
  EXPECT_TRUE(sut.create_event("new"));
  EXPECT_EQ(header_of(memory).repairs.load(), 1U);
}

TEST_F(PoolCrash, ListsAreMadeAnewIfWhatWasNotedIsSpoiledOrTooMuch) {
  auto sut = create(64);
  sut.create_event("kept")->set_registered(true);
  const MemoryFile memory = map();
  const auto spoil = [&](PoolHeader& header, PoolJournal& journal) {
    auto* const buckets = reinterpret_cast<Link*>(memory.bytes().data() + buckets_offset(64));
    for (std::uint32_t i = 0; i < bucket_count_for(64); ++i) journal.set(buckets[i], 0);
    journal.set(header.high_water, 0);
  };
  die_in_the_midst(memory, spoil);  // more than there are notes
  EXPECT_TRUE(sut.open_event("kept"));
  EXPECT_GE(header_of(memory).rebuilds.load(), 1U);
  for (const std::uint64_t place : {0ULL, 20ULL, 48ULL, 50ULL, 175ULL, 1ULL << 20, ~0ULL >> 32}) {
    die_in_the_midst(memory, [&](PoolHeader& header, PoolJournal& journal) {
      auto* const buckets = reinterpret_cast<Link*>(memory.bytes().data() + buckets_offset(64));
      journal.set(buckets[0], 0);
      std::fill_n(buckets, bucket_count_for(64), 0U);
      header.notes[0] = place << 32;
    });
    EXPECT_TRUE(sut.open_event("kept")) << place;
  }
  die_in_the_midst(memory, [](PoolHeader& header, PoolJournal&) { header.noted = 64; });
  EXPECT_TRUE(sut.open_event("kept"));
  EXPECT_EQ(sut.list()->size(), 1U);
}

TEST_F(PoolCrash, WhoMayOnlyReadDoesNotWaitForADeadOne) {
  auto sut = create(64);
  const auto held = sut.create_semaphore("semaphore", 3);
  const auto reader = ObjectPool::attach(name_.get(), MemoryFile::Access::read_only);
  die_in_the_midst(map(), [](PoolHeader& header, PoolJournal& journal) {
    header.changes.fetch_or(1);
    journal.set(header.high_water, header.high_water.load() + 1);
  });
  Duration shortest = Duration::max();
  constexpr int kLooks = 10;
  for (int i = 0; i < kLooks; ++i) {
    const TimePoint begin = MonotonicClock::now();
    EXPECT_EQ(reader->look_at("semaphore")->value, 3U);
    shortest = std::min<Duration>(shortest, MonotonicClock::now() - begin);
  }
  EXPECT_LT(shortest, std::chrono::milliseconds(50)) << "each of them waits so long for a living one";
  EXPECT_TRUE(reader->open_semaphore("semaphore", MemoryFile::Access::read_only));
}

TEST_F(PoolCrash, WorksOnAfterClientsWereKilledAtAnyInstruction) {
  constexpr std::uint32_t kObjects = 64;
  auto sut = create(kObjects);
  sut.create_event("kept")->set_registered(true);
  for (int round = 0; round < 60; ++round) {
    std::array<pid_t, 2> children{};
    for (std::size_t c = 0; c < children.size(); ++c) {
      children[c] = in_child([&] {
        auto pool = ObjectPool::attach(name_.get());
        for (unsigned i = 0;; ++i) {  // more names than places: makes, finds and reclaims
          auto event = pool->create_event("child" + std::to_string((i * 31 + c) % 200));
          if (event && i % 3 == 0) event->post();
        }
      });
    }
    std::this_thread::sleep_for(std::chrono::microseconds(1500 + 91 * round));
    for (const pid_t child : children) kill_and_reap(child);
    const auto kept = sut.open_event("kept");
    ASSERT_TRUE(kept) << kept.error().describe();
    EXPECT_TRUE(kept->registered());
    for (std::uint32_t i = 0; i < 2 * kObjects; ++i) {
      const auto event = sut.create_event("round" + std::to_string(i));
      ASSERT_TRUE(event) << event.error().describe();
      ASSERT_TRUE(sut.open_event("round" + std::to_string(i)));
    }
    ASSERT_EQ(sut.list()->size(), 1U);
  }
}

TEST_F(PoolCrash, RefusesWhatIsNotAPoolOfThisVersionAndSize) {
  create(64);
  const MemoryFile memory = map();
  PoolHeader& header = header_of(memory);
  header.magic_again.store(0);
  const auto refused = [&] { return ObjectPool::attach(name_.get()).error().code == ErrorCode::corrupt; };
  for (std::uint32_t* field :
       {&header.version, &header.entry_size, &header.max_objects, &header.bucket_count}) {
    const std::uint32_t before = *field;
    for (const std::uint32_t value : {0U, before + 1, ~0U}) {
      *field = value;
      EXPECT_TRUE(refused());
      EXPECT_EQ(ObjectPool::create(name_.get()).error().code, ErrorCode::corrupt);
    }
    *field = before;
  }
  header.size += 1;
  EXPECT_TRUE(refused());
  header.size -= 1;
  header.magic.store(1);
  EXPECT_TRUE(refused());
  header.magic.store(kPoolMagic);
  EXPECT_TRUE(ObjectPool::attach(name_.get()));
}

TEST_F(PoolCrash, AHeaderThatAStrangerWroteOverIsMendedByWhoHasItOpen) {
  auto sut = create(64);
  const MemoryFile memory = map();
  std::ranges::fill(memory.bytes().first(offsetof(PoolHeader, mutex)), std::byte{0x5a});
  header_of(memory).max_objects_again = 0;
  EXPECT_EQ(ObjectPool::attach(name_.get()).error().code, ErrorCode::corrupt);
  EXPECT_EQ(sut.tidy().headers_mended, 1U);
  EXPECT_TRUE(ObjectPool::attach(name_.get()));
  EXPECT_EQ(sut.tidy().headers_mended, 0U) << "it is told once";
}

TEST_F(PoolCrash, AHeaderThatAStrangerWroteOverKeepsNobodyFromAttaching) {
  auto first = create(64);
  first.create_event("kept")->set_registered(true);
  const MemoryFile memory = map();
  for (const std::uint8_t byte : {0x5a, 0x00, 0xff}) {
    std::ranges::fill(memory.bytes().first(offsetof(PoolHeader, mutex)), std::byte{byte});
    EXPECT_TRUE(ObjectPool::attach(name_.get(), ObjectPool::Access::read_only));
    auto sut = ObjectPool::attach(name_.get());
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_TRUE(sut->create_event("new"));
    EXPECT_EQ(header_of(memory).magic.load(), kPoolMagic) << "and it is mended";
  }
}

TEST_F(PoolCrash, RefusesAFileThatIsShorterThanItsHeaderSays) {
  create(64);
  ASSERT_EQ(::truncate(("/dev/shm/" + name_.get()).c_str(), 4096), 0);
  EXPECT_EQ(ObjectPool::attach(name_.get()).error().code, ErrorCode::corrupt);
}

TEST_F(PoolCrash, ADamagedMutexIsMendedOrAnErrorAndNotTheEnd) {
  auto sut = create(64);
  const MemoryFile memory = map();
  auto& word = reinterpret_cast<std::atomic<std::uint32_t>&>(header_of(memory).mutex);
  for (const std::uint32_t value : {0x3fffffffU, 0x3ffffffeU, 2U, 0x40000000U, 0x80000000U, 0xffffffffU}) {
    word = value;
    const auto made = sut.create_event("a");
    EXPECT_TRUE(made || made.error().code == ErrorCode::corrupt || made.error().code == ErrorCode::timed_out);
    word = 0;
    EXPECT_TRUE(sut.create_event("a"));
  }
}

TEST_F(PoolCrash, RepairsAChainThatRunsInACircleOrLeadsOutside) {
  constexpr std::uint32_t kObjects = 64;
  auto sut = create(kObjects);
  for (std::uint32_t i = 0; i < kObjects / 2; ++i) ASSERT_TRUE(sut.create_event("event" + std::to_string(i)));
  const MemoryFile memory = map();
  ObjectEntry* const entries = entries_of(memory, kObjects);
  const auto self = [](std::uint32_t i) { return i + 1; };
  const auto outside = [](std::uint32_t) { return ~0U; };
  const auto other = [](std::uint32_t i) { return (i + 7) % kObjects + 1; };
  for (const auto& link : std::initializer_list<std::uint32_t (*)(std::uint32_t)>{self, outside, other}) {
    for (std::uint32_t i = 0; i < kObjects; ++i) entries[i].next.store(link(i));
    header_of(memory).first_free.store(link(3));
    EXPECT_EQ(sut.open_event("absent").error().code, ErrorCode::not_found);
    for (std::uint32_t i = 0; i < kObjects / 2; ++i) EXPECT_TRUE(sut.open_event("event" + std::to_string(i)));
    EXPECT_TRUE(sut.create_event("new"));
    EXPECT_GT(sut.tidy().rebuilds, 0U);
    EXPECT_EQ(sut.tidy().rebuilds, 0U) << "it is told once";
  }
}

TEST_F(PoolCrash, WhoWaitsForAnObjectThatIsLostIsTold) {
  auto sut = create(64);
  const auto semaphore = sut.create_semaphore("semaphore", 0);
  const auto mutex = sut.create_mutex("mutex");
  ASSERT_TRUE(semaphore && mutex);
  ASSERT_EQ(mutex->object.lock(), ObjectStatus::done);
  std::thread taker([&] { EXPECT_EQ(semaphore->object.wait(), ObjectStatus::gone); });
  std::thread locker([&] { EXPECT_EQ(mutex->object.lock(), ObjectStatus::gone); });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const MemoryFile memory = map();
  for (std::uint32_t i = 0; i < 64; ++i) entries_of(memory, 64)[i].binding.fetch_add(std::uint64_t{1} << 32);
  taker.join();
  locker.join();
}

TEST_F(PoolCrash, AScribbledSegmentNeverCrashes) {
  constexpr std::uint32_t kObjects = 64;
  std::mt19937 random(12345);
  for (int round = 0; round < 200; ++round) {
    ObjectPool::remove(name_.get());
    auto sut = create(kObjects);
    for (std::uint32_t i = 0; i < kObjects / 2; ++i) {
      sut.create_event("event" + std::to_string(i))->set_registered(i % 2 == 0);
    }
    const MemoryFile memory = map();
    // All but the mutex, where a living thread's number means to wait for it: it is looked at above.
    constexpr std::size_t kFirst = offsetof(PoolHeader, changes);
    for (int i = 0; i < 1 << (round % 13); ++i) {
      memory.bytes()[kFirst + random() % (memory.bytes().size() - kFirst)] = static_cast<std::byte>(random());
    }
    (void)sut.list();
    (void)sut.open_event("event1");
    for (std::uint32_t i = 0; i < 2 * kObjects; ++i) {
      auto event = sut.create_event("new" + std::to_string(i));
      if (event) event->post();
      const std::string name = "new" + std::to_string(i % 7);
      const auto mutex = sut.create_mutex(name);
      if (mutex) (void)mutex->object.try_lock();
      const auto held = sut.create_memory(name + "m", 64);
      if (held) held->object.bytes()[0] = std::byte{1};
    }
    (void)sut.list();
    (void)ObjectPool::attach(name_.get());
  }
}

// Else no process could open or make an object any more, though the table is nearly empty.
TEST_F(PoolCrash, ATableOfReferencesThatOnlyLooksFullIsMadeAnew) {
  ObjectPool pool = create(16);
  const MemoryFile memory = map();
  PoolHeader& header = header_of(memory);
  const auto first = pool.create_semaphore("first", 1);
  ASSERT_TRUE(first);
  for (const std::uint32_t scribble : {max_references_for(16), UINT32_MAX}) {
    for (const std::uint32_t link : {0U, UINT32_MAX}) {
      header.reference_high_water = scribble;
      header.first_free_reference = link;
      const auto again = pool.open_semaphore("first");
      ASSERT_TRUE(again) << again.error().describe();
      EXPECT_EQ(pool.look_at("first")->reference_count, 2U);
    }
  }
}

}  // namespace
}  // namespace plchost
