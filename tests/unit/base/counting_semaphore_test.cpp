#include "shm/base/counting_semaphore.hpp"

#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace plchost {
namespace {

TimePoint soon(std::chrono::milliseconds time) {
  return MonotonicClock::now() + time;
}

TEST(CountingSemaphore, GivesAsManyAsItHas) {
  CountingSemaphore sut(2);
  EXPECT_TRUE(sut.try_wait());
  EXPECT_TRUE(sut.wait());
  EXPECT_FALSE(sut.try_wait());
  EXPECT_FALSE(sut.wait(soon(std::chrono::milliseconds(1))));
  EXPECT_TRUE(sut.post());
  EXPECT_EQ(sut.value(), 1U);
  EXPECT_TRUE(sut.wait());
}

TEST(CountingSemaphore, PostBeyondTheMostIsRefused) {
  CountingSemaphore sut(CountingSemaphore::kMaxValue);
  EXPECT_FALSE(sut.post());
  EXPECT_TRUE(sut.try_wait());
  EXPECT_TRUE(sut.post());
  EXPECT_EQ(sut.value(), CountingSemaphore::kMaxValue);
}

TEST(CountingSemaphore, EachPostLetsOneWaiterGoOn) {
  CountingSemaphore sut;
  std::atomic<int> through{0};
  std::vector<std::thread> waiters;
  for (int i = 0; i < 4; ++i) {
    waiters.emplace_back([&] {
      for (int n = 0; n < 2000; ++n) {
        ASSERT_TRUE(sut.wait());
        ++through;
      }
    });
  }
  for (int n = 0; n < 8000; ++n) ASSERT_TRUE(sut.post());
  for (auto& waiter : waiters) waiter.join();
  EXPECT_EQ(through, 8000);
  EXPECT_EQ(sut.value(), 0U);
}

TEST(CountingSemaphore, UnitThatAKilledPosterAddedWithoutAWakeIsFound) {
  alignas(4) CountingSemaphore sut;
  std::thread waiter([&] { EXPECT_TRUE(sut.wait(soon(std::chrono::seconds(20)))); });
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  // As post() leaves it between its two steps.
  reinterpret_cast<std::atomic<std::uint32_t>&>(sut).fetch_add(2);
  waiter.join();
}

}  // namespace
}  // namespace plchost
