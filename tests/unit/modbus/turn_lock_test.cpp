#include "instances/io/modbus/threads/turn_lock.hpp"

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/sleeping_thread.hpp"

namespace plchost::modbus {
namespace {

// Asks for the lock in a thread of its own, and notes its number when it has it.
class Asker {
 public:
  Asker(TurnLock& lock, std::vector<int>& order, int number)
      : thread_([this, &lock, &order, number] {
          id_ = ::gettid();
          const std::lock_guard turn(lock);
          order.push_back(number);
        }) {
    while (id_ == 0 || !sleeps(id_)) std::this_thread::yield();
  }
  ~Asker() { thread_.join(); }
  Asker(const Asker&) = delete;
  Asker& operator=(const Asker&) = delete;

 private:
  std::atomic<pid_t> id_{0};
  std::thread thread_;
};

TEST(TurnLock, IsGivenInTheOrderInWhichThreadsAsk) {
  TurnLock sut;
  std::vector<int> order;
  sut.lock();
  {
    const Asker first(sut, order, 1);
    const Asker second(sut, order, 2);
    sut.unlock();
    sut.lock();  // one that takes it again and again
    order.push_back(3);
    sut.unlock();
  }
  EXPECT_EQ(order, (std::vector{1, 2, 3}));
}

TEST(TurnLock, AThreadThatHasItTakesItOnceMore) {
  TurnLock sut;
  std::vector<int> order;
  {
    std::unique_lock outer(sut);
    const Asker other(sut, order, 2);
    {
      const std::unique_lock inner(sut);
      order.push_back(1);
    }
    EXPECT_EQ(order, std::vector{1}) << "the outer one still holds it";
    outer.unlock();
  }
  EXPECT_EQ(order, (std::vector{1, 2}));
}

}  // namespace
}  // namespace plchost::modbus
