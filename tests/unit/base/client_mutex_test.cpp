#include "shm/threads/client_mutex.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <new>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/threads/process_start.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

/// Here the number of a client is that of its process.
class ProcessRoll final : public ClientRoll {
 public:
  [[nodiscard]] bool lives(std::uint32_t client) const noexcept override {
    return look_at_thread(static_cast<pid_t>(client)).has_value();
  }
};

ClientThread this_client() {
  return {.client = static_cast<std::uint32_t>(::getpid()), .thread = static_cast<std::uint32_t>(::gettid())};
}

/// Memory that children of fork() share.
struct SharedClientLock {
  ClientMutex mutex;
  std::atomic<std::uint32_t> step{0};
  std::uint64_t a = 0;
  std::uint64_t b = 0;
};

class ClientMutexTest : public testing::Test {
 protected:
  ClientMutexTest()
      : shared_(*new(::mmap(nullptr, sizeof(SharedClientLock), PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_ANONYMOUS, -1, 0)) SharedClientLock) {}
  ~ClientMutexTest() override { ::munmap(&shared_, sizeof(SharedClientLock)); }

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
  pid_t hold_in_child() {
    const pid_t child = in_child([this] {
      (void)lock();
      shared_.step = 1;
      for (;;) ::pause();
    });
    await_step(1);
    return child;
  }
  [[nodiscard]] LockResult lock(TimePoint deadline = kNoDeadline) const {
    return shared_.mutex.lock(this_client(), roll_, deadline);
  }
  [[nodiscard]] bool unlock() const { return shared_.mutex.unlock(this_client()); }
  static TimePoint in(milliseconds time) { return MonotonicClock::now() + time; }

  SharedClientLock& shared_;
  ProcessRoll roll_;
};

TEST_F(ClientMutexTest, LocksAndUnlocks) {
  EXPECT_EQ(shared_.mutex.client(), 0U);
  ASSERT_EQ(lock(), LockResult::locked);
  EXPECT_EQ(shared_.mutex.client(), this_client().client);
  EXPECT_EQ(shared_.mutex.thread(), this_client().thread);
  EXPECT_TRUE(unlock());
  EXPECT_EQ(shared_.mutex.client(), 0U);
  EXPECT_EQ(shared_.mutex.thread(), 0U);
}

TEST_F(ClientMutexTest, RefusesASecondLockOfItsOwnerAndAnUnlockOfOthers) {
  EXPECT_FALSE(unlock());
  ASSERT_EQ(lock(), LockResult::locked);
  EXPECT_EQ(lock(), LockResult::deadlock);
  EXPECT_EQ(shared_.mutex.try_lock(this_client()), LockResult::deadlock);
  std::thread([this] {
    EXPECT_FALSE(unlock());
    EXPECT_EQ(shared_.mutex.try_lock(this_client()), LockResult::timed_out);
    EXPECT_EQ(lock(in(milliseconds(1))), LockResult::timed_out);
  }).join();
  EXPECT_TRUE(unlock());
}

// As in two containers, where each has a process 1 with a thread 1.
TEST_F(ClientMutexTest, ThreadOfTheSameNumberInAnotherProcessIsNotTheOwner) {
  const pid_t other = in_child([] { ::pause(); });
  const ClientThread one{.client = static_cast<std::uint32_t>(other), .thread = 1};
  const ClientThread two{.client = this_client().client, .thread = 1};
  ASSERT_EQ(shared_.mutex.lock(one, roll_), LockResult::locked);
  EXPECT_FALSE(shared_.mutex.unlock(two));
  EXPECT_EQ(shared_.mutex.lock(two, roll_, in(milliseconds(100))), LockResult::timed_out);
  EXPECT_TRUE(shared_.mutex.unlock(one));
  reap(other);
}

TEST_F(ClientMutexTest, SaysOnceThatTheOwnerDiedWhenNobodyWaited) {
  const pid_t child = hold_in_child();
  EXPECT_FALSE(shared_.mutex.owner_has_ended(roll_));
  reap(child);
  EXPECT_TRUE(shared_.mutex.owner_has_ended(roll_));
  EXPECT_EQ(lock(), LockResult::owner_died);
  EXPECT_FALSE(shared_.mutex.owner_has_ended(roll_));
  EXPECT_TRUE(unlock());
  EXPECT_EQ(lock(), LockResult::locked);
  EXPECT_TRUE(unlock());
}

TEST_F(ClientMutexTest, OneDeathIsToldOnceAndLetsOneInHoweverManyWait) {
  for (int round = 0; round < 5; ++round) {
    const pid_t child = hold_in_child();
    std::atomic<int> inside{0};
    std::atomic<int> deaths{0};
    std::vector<std::thread> waiters;
    for (int i = 0; i < 12; ++i) {
      waiters.emplace_back([&] {
        const LockResult result = lock();
        deaths += result == LockResult::owner_died ? 1 : 0;
        EXPECT_TRUE(result == LockResult::locked || result == LockResult::owner_died);
        EXPECT_EQ(inside.fetch_add(1), 0);
        std::this_thread::sleep_for(std::chrono::microseconds(500));
        inside.fetch_sub(1);
        EXPECT_TRUE(unlock());
      });
    }
    std::this_thread::sleep_for(2 * RobustMutex::kLook);  // as they look
    reap(child);
    for (auto& waiter : waiters) waiter.join();
    EXPECT_EQ(deaths, 1);
    shared_.step = 0;
  }
}

TEST_F(ClientMutexTest, ThreadThatEndsWithoutUnlockingIsADeadOwnerIfItsProcessSaysSo) {
  std::atomic<bool> held{false};
  std::thread owner([&] {
    EXPECT_EQ(lock(), LockResult::locked);
    held = true;
    std::this_thread::sleep_for(milliseconds(20));  // somebody waits by then
    shared_.mutex.abandon(this_client());
  });
  while (!held) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(lock(), LockResult::owner_died);
  owner.join();
  shared_.mutex.abandon({.client = this_client().client, .thread = this_client().thread + 1});
  EXPECT_TRUE(unlock()) << "another thread's end does not matter";
}

TEST_F(ClientMutexTest, IsNeverTakenFromTheLivingHoweverLongTheyHoldIt) {
  std::atomic<int> inside{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&] {
      for (int n = 0; n < 4; ++n) {
        ASSERT_EQ(lock(), LockResult::locked);
        ASSERT_EQ(inside.fetch_add(1), 0);
        // As often as waiters look.
        std::this_thread::sleep_for(RobustMutex::kLook - std::chrono::microseconds(100));
        inside.fetch_sub(1);
        ASSERT_TRUE(unlock());
      }
    });
  }
  for (auto& thread : threads) thread.join();
}

TEST_F(ClientMutexTest, WhateverAStrangerWritesALockEndsAndTheNextOnesDoToo) {
  std::mt19937_64 random(4711);
  for (int round = 0; round < 200; ++round) {
    std::array<std::uint64_t, 2> words{random() >> (round % 33), round % 3 == 0 ? 0 : random()};
    std::memcpy(static_cast<void*>(&shared_.mutex), words.data(), sizeof words);
    (void)lock(in(milliseconds(50)));
    (void)unlock();
    (void)shared_.mutex.thread();
    words = {};
    std::memcpy(static_cast<void*>(&shared_.mutex), words.data(), sizeof words);
    ASSERT_EQ(lock(in(milliseconds(20'000))), LockResult::locked);
    ASSERT_TRUE(unlock());
  }
}

TEST_F(ClientMutexTest, KilledOwnersNeverLeaveItHeldNorLetTwoIn) {
  std::mt19937 random(11);
  for (int round = 0; round < 60; ++round) {
    std::array<pid_t, 3> children{};
    for (pid_t& child : children) {
      child = in_child([this] {
        for (;;) {
          const LockResult result = lock();
          if (result == LockResult::owner_died) shared_.b = shared_.a;
          if (shared_.a != shared_.b) ::_exit(1);
          ++shared_.a;
          ++shared_.b;
          (void)unlock();
        }
      });
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 8000));
    for (const pid_t child : children) {
      int status = 0;
      ::kill(child, SIGKILL);
      ::waitpid(child, &status, 0);
      ASSERT_TRUE(WIFSIGNALED(status)) << "two were in it";
    }
    const LockResult result = lock(in(milliseconds(20'000)));
    ASSERT_TRUE(result == LockResult::locked || result == LockResult::owner_died);
    shared_.b = shared_.a;
    ASSERT_TRUE(unlock());
  }
}

}  // namespace
}  // namespace plchost
