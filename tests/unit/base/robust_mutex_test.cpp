#include "shm/threads/robust_mutex.hpp"

#include <array>
#include <chrono>
#include <cstring>
#include <new>
#include <random>
#include <thread>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/threads/process_start.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

/// Memory that children of fork() share.
struct SharedLock {
  RobustMutex mutex;
  std::atomic<std::uint32_t> step{0};
  std::uint64_t a = 0;
  std::uint64_t b = 0;
};

class RobustMutexTest : public testing::Test {
 protected:
  RobustMutexTest()
      : shared_(*new(::mmap(nullptr, sizeof(SharedLock), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS,
                            -1, 0)) SharedLock) {}
  ~RobustMutexTest() override { ::munmap(&shared_, sizeof(SharedLock)); }

  template <class Body>
  static pid_t in_child(Body body) {
    const pid_t child = ::fork();
    if (child != 0) return child;
    body();
    ::_exit(0);
  }
  static void reap(pid_t child) {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  void await_step(std::uint32_t step) const {
    while (shared_.step.load() != step) std::this_thread::sleep_for(milliseconds(1));
  }
  /// A child that holds the mutex until it is killed.
  pid_t hold_in_child() {
    const pid_t child = in_child([this] {
      (void)shared_.mutex.lock();
      shared_.step = 1;
      for (;;) ::pause();
    });
    await_step(1);
    return child;
  }
  static TimePoint in(milliseconds time) { return MonotonicClock::now() + time; }

  SharedLock& shared_;
};

TEST_F(RobustMutexTest, LocksAndUnlocks) {
  EXPECT_EQ(shared_.mutex.owner(), 0U);
  ASSERT_EQ(shared_.mutex.lock(), LockResult::locked);
  EXPECT_EQ(shared_.mutex.owner(), static_cast<std::uint32_t>(::gettid()));
  EXPECT_TRUE(shared_.mutex.unlock());
  EXPECT_EQ(shared_.mutex.owner(), 0U);
}

TEST_F(RobustMutexTest, RefusesASecondLockOfItsOwnerAndAnUnlockOfOthers) {
  EXPECT_FALSE(shared_.mutex.unlock());
  ASSERT_EQ(shared_.mutex.lock(), LockResult::locked);
  EXPECT_EQ(shared_.mutex.lock(), LockResult::deadlock);
  EXPECT_EQ(shared_.mutex.try_lock(), LockResult::deadlock);
  std::thread([this] {
    EXPECT_FALSE(shared_.mutex.unlock());
    EXPECT_EQ(shared_.mutex.try_lock(), LockResult::timed_out);
    EXPECT_EQ(shared_.mutex.lock(in(milliseconds(1))), LockResult::timed_out);
  }).join();
  EXPECT_TRUE(shared_.mutex.unlock());
}

TEST_F(RobustMutexTest, SaysOnceThatTheOwnerDiedWhenNobodyWaited) {
  reap(hold_in_child());
  EXPECT_EQ(shared_.mutex.lock(), LockResult::owner_died);
  EXPECT_TRUE(shared_.mutex.unlock());
  EXPECT_EQ(shared_.mutex.lock(), LockResult::locked);
  EXPECT_TRUE(shared_.mutex.unlock());
}

TEST_F(RobustMutexTest, HandsOverToAWaiterWhenTheOwnerDies) {
  const pid_t child = hold_in_child();
  std::thread waiter([this] {
    EXPECT_EQ(shared_.mutex.lock(), LockResult::owner_died);
    EXPECT_TRUE(shared_.mutex.unlock());
  });
  std::this_thread::sleep_for(milliseconds(10));
  reap(child);
  waiter.join();
  EXPECT_EQ(shared_.mutex.lock(), LockResult::locked);
  EXPECT_TRUE(shared_.mutex.unlock());
}

TEST_F(RobustMutexTest, OwnerThatIsNotReapedYetIsDeadAllTheSame) {
  const pid_t child = hold_in_child();
  ::kill(child, SIGKILL);
  EXPECT_EQ(shared_.mutex.lock(), LockResult::owner_died);
  EXPECT_TRUE(shared_.mutex.unlock());
  reap(child);
}

TEST_F(RobustMutexTest, ThreadThatEndsWithoutUnlockingIsADeadOwner) {
  std::thread([this] { EXPECT_EQ(shared_.mutex.lock(), LockResult::locked); }).join();
  EXPECT_EQ(shared_.mutex.lock(), LockResult::owner_died);
  EXPECT_TRUE(shared_.mutex.unlock());
}

TEST_F(RobustMutexTest, OneDeathIsToldOnceAndLetsOneInHoweverManyWaitForLong) {
  for (int round = 0; round < 10; ++round) {
    const pid_t child = hold_in_child();
    std::atomic<int> inside{0};
    std::atomic<int> deaths{0};
    std::vector<std::thread> waiters;
    for (int i = 0; i < 12; ++i) {
      waiters.emplace_back([&] {
        const LockResult result = shared_.mutex.lock();
        deaths += result == LockResult::owner_died ? 1 : 0;
        EXPECT_TRUE(result == LockResult::locked || result == LockResult::owner_died);
        EXPECT_EQ(inside.fetch_add(1), 0);
        std::this_thread::sleep_for(std::chrono::microseconds(500));
        inside.fetch_sub(1);
        EXPECT_TRUE(shared_.mutex.unlock());
      });
    }
    std::this_thread::sleep_for(3 * RobustMutex::kLook);  // as they look
    reap(child);
    for (auto& waiter : waiters) waiter.join();
    EXPECT_EQ(deaths, 1);
    shared_.step = 0;
  }
}

/// The word of one that is held by `thread`, which began at `start`.
void pretend(RobustMutex& mutex, std::uint32_t thread, std::uint64_t start) {
  const std::uint64_t record = start << 30 | thread;
  std::memcpy(static_cast<void*>(&mutex), &thread, sizeof(thread));
  std::memcpy(reinterpret_cast<std::byte*>(&mutex) + 8, start == 0 ? &start : &record, sizeof(record));
}

TEST_F(RobustMutexTest, ThreadThatWasGivenTheNumberOfADeadOwnerIsNotTheOwner) {
  const pid_t stranger = in_child([] { ::pause(); });
  pretend(shared_.mutex, static_cast<std::uint32_t>(stranger), 1);
  std::vector<std::thread> waiters;
  std::atomic<int> deaths{0};
  for (int i = 0; i < 4; ++i) {
    waiters.emplace_back([&] {
      const LockResult result = shared_.mutex.lock(in(milliseconds(20'000)));
      EXPECT_TRUE(result == LockResult::locked || result == LockResult::owner_died);
      deaths += result == LockResult::owner_died ? 1 : 0;
      EXPECT_TRUE(shared_.mutex.unlock());
    });
  }
  for (auto& waiter : waiters) waiter.join();
  EXPECT_GE(deaths, 1);
  reap(stranger);
}

TEST_F(RobustMutexTest, DeadOwnerThatHadTheNumberOfTheCallerIsNotTheCaller) {
  pretend(shared_.mutex, this_thread().id, this_thread().start + 1);
  EXPECT_EQ(shared_.mutex.lock(), LockResult::owner_died);
  EXPECT_TRUE(shared_.mutex.unlock());
}

TEST_F(RobustMutexTest, OwnerWhoseProgramWasReplacedIsDead) {
  const pid_t child = in_child([this] {
    (void)shared_.mutex.lock();
    shared_.step = 1;
    ::execlp("sleep", "sleep", "60", static_cast<char*>(nullptr));
  });
  await_step(1);
  EXPECT_EQ(shared_.mutex.lock(in(milliseconds(20'000))), LockResult::owner_died);
  EXPECT_TRUE(shared_.mutex.unlock());
  reap(child);
}

TEST_F(RobustMutexTest, SaysWhetherItsOwnerHasEnded) {
  EXPECT_FALSE(shared_.mutex.owner_has_ended());
  const pid_t child = hold_in_child();
  EXPECT_FALSE(shared_.mutex.owner_has_ended());
  reap(child);
  EXPECT_TRUE(shared_.mutex.owner_has_ended());
  EXPECT_EQ(shared_.mutex.lock(), LockResult::owner_died);
  EXPECT_FALSE(shared_.mutex.owner_has_ended());
  EXPECT_TRUE(shared_.mutex.unlock());
}

TEST_F(RobustMutexTest, LivingOwnerThatHasNotToldItsStartYetIsWaitedFor) {
  const pid_t owner = in_child([] { ::pause(); });
  pretend(shared_.mutex, static_cast<std::uint32_t>(owner), 0);
  EXPECT_EQ(shared_.mutex.lock(in(milliseconds(200))), LockResult::timed_out);
  reap(owner);
  EXPECT_EQ(shared_.mutex.lock(), LockResult::owner_died);
  EXPECT_TRUE(shared_.mutex.unlock());
}

/// A process that has no descriptor left cannot read its own identity.
void use_up_descriptors() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = 0;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

TEST_F(RobustMutexTest, LivingOwnerWithoutADescriptorIsNotRobbed) {
  const pid_t owner = in_child([this] {
    use_up_descriptors();
    if (shared_.mutex.lock() != LockResult::locked) ::_exit(1);
    if (shared_.mutex.lock() != LockResult::deadlock) ::_exit(1);
    shared_.step = 1;
    for (;;) ::pause();
  });
  await_step(1);
  EXPECT_EQ(shared_.mutex.lock(in(milliseconds(200))), LockResult::timed_out);
  EXPECT_FALSE(shared_.mutex.owner_has_ended());
  reap(owner);
  EXPECT_EQ(shared_.mutex.lock(), LockResult::owner_died);
  EXPECT_TRUE(shared_.mutex.unlock());
}

TEST_F(RobustMutexTest, LivingOwnerIsNotRobbedByWhoHasNoDescriptor) {
  const pid_t owner = hold_in_child();
  const pid_t other = in_child([this] {
    use_up_descriptors();
    ::_exit(shared_.mutex.lock(in(milliseconds(200))) == LockResult::timed_out ? 0 : 1);
  });
  int status = -1;
  ::waitpid(other, &status, 0);
  EXPECT_EQ(status, 0);
  reap(owner);
}

TEST_F(RobustMutexTest, ProcessWithoutADescriptorIsNotTakenForAnotherOne) {
  static_assert(std::is_trivially_copyable_v<ProcessIdentity>);
  auto& said = *new (::mmap(nullptr, sizeof(ProcessIdentity), PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_ANONYMOUS, -1, 0)) ProcessIdentity;
  const pid_t child = in_child([&] {
    use_up_descriptors();
    said = this_process();
    shared_.step = 1;
    for (;;) ::pause();
  });
  await_step(1);
  EXPECT_EQ(said.pid, child);
  EXPECT_FALSE(process_has_ended(said));
  EXPECT_TRUE(process_has_ended({.pid = child, .start = 1})) << "that one began long before";
  reap(child);
  EXPECT_TRUE(process_has_ended(said));
  ::munmap(&said, sizeof(said));
}

TEST_F(RobustMutexTest, IsNeverTakenFromTheLivingHoweverLongTheyHoldIt) {
  std::atomic<int> inside{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      for (int n = 0; n < 6; ++n) {
        ASSERT_EQ(shared_.mutex.lock(), LockResult::locked);
        ASSERT_EQ(inside.fetch_add(1), 0);
        std::this_thread::sleep_for(milliseconds(40) -
                                    std::chrono::microseconds(100));  // as often as waiters look
        inside.fetch_sub(1);
        ASSERT_TRUE(shared_.mutex.unlock());
      }
    });
  }
  for (auto& thread : threads) thread.join();
}

TEST_F(RobustMutexTest, WhateverAStrangerWritesALockEndsAndTheNextOnesDoToo) {
  std::mt19937_64 random(4711);
  for (int round = 0; round < 60; ++round) {
    const auto word = static_cast<std::uint32_t>(random() >> (round % 33));
    pretend(shared_.mutex, word, round % 3 == 0 ? 0 : random());
    (void)shared_.mutex.lock(in(milliseconds(300)));
    (void)shared_.mutex.unlock();
    (void)shared_.mutex.owner();
    pretend(shared_.mutex, 0, 0);
    ASSERT_EQ(shared_.mutex.lock(in(milliseconds(20'000))), LockResult::locked);
    ASSERT_TRUE(shared_.mutex.unlock());
  }
}

TEST_F(RobustMutexTest, GuardsAgainstEachOther) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([this] {
      for (int n = 0; n < 5000; ++n) {
        ASSERT_EQ(shared_.mutex.lock(), LockResult::locked);
        ++shared_.a;
        ASSERT_TRUE(shared_.mutex.unlock());
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(shared_.a, 20'000U);
}

TEST_F(RobustMutexTest, KilledOwnersNeverLeaveItHeldNorLetTwoIn) {
  for (int round = 0; round < 200; ++round) {
    std::array<pid_t, 3> children{};
    for (pid_t& child : children) {
      child = in_child([this] {
        for (;;) {
          const LockResult result = shared_.mutex.lock();
          if (result == LockResult::owner_died) shared_.b = shared_.a;
          if (shared_.a != shared_.b) {
            shared_.step = 99;  // two were in at once
            ::_exit(1);
          }
          shared_.a = shared_.a + 1;
          shared_.b = shared_.b + 1;
          (void)shared_.mutex.unlock();
        }
      });
    }
    std::this_thread::sleep_for(std::chrono::microseconds(300 + 71 * (round % 40)));
    for (const pid_t child : children) reap(child);
    const LockResult result = shared_.mutex.lock(in(milliseconds(20'000)));
    ASSERT_TRUE(result == LockResult::locked || result == LockResult::owner_died);
    if (result == LockResult::owner_died) shared_.b = shared_.a;
    ASSERT_EQ(shared_.a, shared_.b);
    ASSERT_TRUE(shared_.mutex.unlock());
    ASSERT_NE(shared_.step.load(), 99U);
  }
}

}  // namespace
}  // namespace plchost
