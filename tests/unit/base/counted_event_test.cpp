#include "shm/base/counted_event.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <new>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/sleeping_thread.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

TimePoint in(milliseconds delay) {
  return MonotonicClock::now() + delay;
}

// Waits until `sut` has counted `target` posts; each wake is a look.
void follow(CountedEvent& sut, std::uint64_t target) {
  for (;;) {
    const auto seen = sut.snapshot();
    if (seen.count() >= target) return;
    sut.wait(seen);
  }
}

template <class T>
class Shared {
 public:
  Shared()
      : value_(new(::mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))
                   T{}) {}
  ~Shared() { ::munmap(static_cast<void*>(value_), sizeof(T)); }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
  T& operator*() const { return *value_; }
  T* operator->() const { return value_; }

 private:
  T* value_;
};

TEST(CountedEvent, AWaiterBesideAPostThatWokeNobodyIsRoused) {
  CountedEvent sut;
  std::atomic<bool> woken{false};
  std::atomic<pid_t> thread{0};
  std::jthread waiter([&] {
    thread = ::gettid();
    follow(sut, 1);
    woken = true;
  });
  auto& word = reinterpret_cast<std::atomic<std::uint64_t>&>(sut);
  constexpr std::uint64_t kWaiter = 1;
  while ((word & kWaiter) == 0 || !sleeps(thread)) std::this_thread::sleep_for(milliseconds(1));
  // The first step of a poster that is killed between its two steps.
  word.fetch_add(std::uint64_t{1} << 16);
  std::this_thread::sleep_for(milliseconds(20));
  EXPECT_FALSE(woken);
  while (!woken) {  // the first time, unless the waiter had not come to its sleep
    sut.rouse();
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(sut.count(), 1U);
}

TEST(CountedEvent, TellsEachPosterOnWhichSideOfAChangeItsPostIs) {
  CountedEvent sut;
  EXPECT_FALSE(sut.post());
  EXPECT_EQ(sut.set_taken(true).count(), 1U);
  EXPECT_TRUE(sut.post());
  EXPECT_TRUE(sut.post());
  EXPECT_EQ(sut.set_taken(false).count(), 3U);
  EXPECT_FALSE(sut.post());
  EXPECT_EQ(sut.count(), 4U);
}

TEST(CountedEvent, CountsAMarkedPostOrNothing) {
  CountedEvent sut;
  sut.set_taken(true);
  auto seen = sut.snapshot();
  ASSERT_TRUE(sut.post_marked(seen));
  EXPECT_TRUE(seen.marked() && seen.taken());
  EXPECT_EQ(seen.count(), 1U);
  EXPECT_TRUE(sut.snapshot().marked());
  sut.post();
  EXPECT_FALSE(sut.post_marked(seen)) << "another post came between";
  EXPECT_EQ(sut.count(), 2U);
  seen = sut.snapshot();
  ASSERT_TRUE(sut.post_marked(seen));
  EXPECT_FALSE(sut.snapshot().marked());
  EXPECT_EQ(sut.count(), 3U);
}

// The bits beside the turns are not theirs, however many waits there are.
TEST(CountedEvent, KeepsMarkAndTakenOverAllTurns) {
  CountedEvent sut;
  auto seen = sut.snapshot();
  ASSERT_TRUE(sut.post_marked(seen));
  sut.set_taken(true);
  for (int i = 0; i < 20'000; ++i) sut.nudge();
  EXPECT_TRUE(sut.snapshot().marked() && sut.snapshot().taken());
  EXPECT_EQ(sut.count(), 1U);
}

// Waiters may come between a marked post and its wake; none of them may be left asleep by it.
TEST(CountedEvent, AMarkedPostWakesWhoSleeps) {
  CountedEvent sut;
  constexpr std::uint64_t kPosts = 20'000;
  std::thread waiter([&] { follow(sut, kPosts); });
  for (std::uint64_t i = 0; i < kPosts; ++i) {
    auto seen = sut.snapshot();
    while (!sut.post_marked(seen)) seen = sut.snapshot();
    sut.wake(seen);
  }
  waiter.join();
  EXPECT_EQ(sut.count(), kPosts);
}

TEST(CountedEvent, EveryCursorSeesEachPost) {
  CountedEvent sut;
  const auto first = sut.snapshot();
  sut.post();
  const auto second = sut.snapshot();
  sut.post();
  sut.post();
  EXPECT_EQ(sut.count() - first.count(), 3U);
  EXPECT_EQ(sut.count() - second.count(), 2U);
}

TEST(CountedEvent, WaitReturnsAtOnceIfPostedSinceTheSnapshot) {
  CountedEvent sut;
  const auto seen = sut.snapshot();
  sut.post();
  EXPECT_EQ(sut.wait(seen), FutexResult::changed);
}

TEST(CountedEvent, WaitEndsAtTheDeadline) {
  CountedEvent sut;
  const TimePoint deadline = in(milliseconds(5));
  EXPECT_EQ(sut.wait(sut.snapshot(), deadline), FutexResult::timed_out);
  EXPECT_GE(MonotonicClock::now(), deadline);
}

TEST(CountedEvent, WaitEndsForADeadlineOfThePast) {
  CountedEvent sut;
  EXPECT_EQ(sut.wait(sut.snapshot(), TimePoint{}), FutexResult::timed_out);
  EXPECT_EQ(sut.wait(sut.snapshot(), TimePoint::min()), FutexResult::timed_out);
}

TEST(CountedEvent, WaitsAnewAfterATimeOutLeftTheFlag) {
  CountedEvent sut;
  EXPECT_EQ(sut.wait(sut.snapshot(), TimePoint{}), FutexResult::timed_out);
  std::thread waiter([&] { follow(sut, 1); });
  sut.post();
  waiter.join();
  EXPECT_EQ(sut.count(), 1U);
}

TEST(CountedEvent, NudgeWakesAndCountsNothing) {
  CountedEvent sut;
  std::atomic<bool> stop{false};
  std::thread waiter([&] {
    for (;;) {
      const auto seen = sut.snapshot();
      if (stop.load()) return;
      sut.wait(seen);
    }
  });
  stop.store(true);
  sut.nudge();
  waiter.join();
  EXPECT_EQ(sut.count(), 0U);
}

TEST(CountedEvent, NudgesWrapWithoutCarryIntoTheCount) {
  CountedEvent sut;
  sut.post();
  constexpr int kMoreThanTheTurnsHold = 100'000;
  for (int i = 0; i < kMoreThanTheTurnsHold; ++i) sut.nudge();
  EXPECT_EQ(sut.count(), 1U);
}

TEST(CountedEvent, AnnouncementsWrapWithoutCarryIntoTheCount) {
  CountedEvent sut;
  sut.post();
  for (int i = 0; i < 70'000; ++i) sut.wait(sut.snapshot(), TimePoint{});
  EXPECT_EQ(sut.count(), 1U);
}

TEST(CountedEvent, OnePostWakesEveryWaiter) {
  CountedEvent sut;
  std::vector<std::thread> waiters;
  for (int i = 0; i < 8; ++i) waiters.emplace_back([&] { follow(sut, 1); });
  std::this_thread::sleep_for(milliseconds(5));
  sut.post();
  for (auto& waiter : waiters) waiter.join();
}

TEST(CountedEvent, LosesNoWakeInAStormOfPosters) {
  constexpr std::uint64_t kPosters = 3;
  constexpr std::uint64_t kPosts = 20'000;
  CountedEvent sut;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back([&] { follow(sut, kPosters * kPosts); });
  for (std::uint64_t i = 0; i < kPosters; ++i) {
    threads.emplace_back([&] {
      for (std::uint64_t post = 0; post < kPosts; ++post) sut.post();
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(sut.count(), kPosters * kPosts);
}

TEST(CountedEvent, LosesNoWakeInPingPong) {
  // Each post is waited for before the next: one lost wake would stand still for ever.
  constexpr std::uint64_t kRounds = 5'000;
  std::array<CountedEvent, 2> sut;
  std::thread other([&] {
    for (std::uint64_t round = 1; round <= kRounds; ++round) {
      follow(sut[0], round);
      sut[1].post();
    }
  });
  for (std::uint64_t round = 1; round <= kRounds; ++round) {
    sut[0].post();
    follow(sut[1], round);
  }
  other.join();
}

TEST(CountedEvent, WorksAcrossProcesses) {
  constexpr std::uint64_t kRounds = 2'000;
  const Shared<std::array<CountedEvent, 2>> sut;
  std::array<pid_t, 3> children{};
  for (pid_t& child : children) {
    child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      for (std::uint64_t round = 1; round <= kRounds; ++round) {
        follow((*sut)[0], round);
        (*sut)[1].post();
      }
      ::_exit(0);
    }
  }
  for (std::uint64_t round = 1; round <= kRounds; ++round) {
    (*sut)[0].post();
    follow((*sut)[1], round * children.size());
  }
  for (const pid_t child : children) {
    int status = -1;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
}

TEST(CountedEvent, WakesSleepersAlthoughPostersAreKilled) {
  const Shared<CountedEvent> sut;
  for (int round = 0; round < 30; ++round) {
    const pid_t poster = ::fork();
    ASSERT_GE(poster, 0);
    if (poster == 0) {
      for (;;) sut->post();
    }
    const pid_t waiter = ::fork();
    ASSERT_GE(waiter, 0);
    if (waiter == 0) {
      for (;;) sut->wait(sut->snapshot());
    }
    std::this_thread::sleep_for(milliseconds(2));
    ::kill(poster, SIGKILL);
    ::kill(waiter, SIGKILL);
    ::waitpid(poster, nullptr, 0);
    ::waitpid(waiter, nullptr, 0);
    const std::uint64_t target = sut->count() + 1;
    std::thread sleeper([&] { follow(*sut, target); });
    std::this_thread::sleep_for(milliseconds(1));
    sut->post();
    sleeper.join();
  }
}

}  // namespace
}  // namespace plchost
