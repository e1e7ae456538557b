#include "instances/runtime/application/message_queue.hpp"

#include <map>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

using ::testing::ElementsAre;

std::vector<std::string> drain(MessageQueue& queue) {
  std::vector<std::string> texts;
  queue.drain([&](int, std::string_view text) { texts.emplace_back(text); });
  return texts;
}

TEST(MessageQueue, HandsMessagesOverInOrder) {
  MessageQueue sut;
  sut.push(0, "one");
  sut.push(1, "two");
  EXPECT_THAT(drain(sut), ElementsAre("one", "two"));
  EXPECT_THAT(drain(sut), ElementsAre());
}

TEST(MessageQueue, CountsWhatFindsNoRoom) {
  MessageQueue sut;
  for (std::size_t i = 0; i < MessageQueue::kCapacity; ++i) EXPECT_TRUE(sut.push(0, "x"));
  EXPECT_FALSE(sut.push(0, "too many"));
  EXPECT_EQ(sut.take_dropped(), 1U);
  EXPECT_EQ(sut.take_dropped(), 0U);
  EXPECT_EQ(drain(sut).size(), MessageQueue::kCapacity);
  EXPECT_TRUE(sut.push(0, "room again"));
  EXPECT_THAT(drain(sut), ElementsAre("room again"));
}

TEST(MessageQueue, CutsATextAtItsBound) {
  MessageQueue sut;
  sut.push(0, std::string(MessageQueue::kMaxText + 10, 'x').c_str());
  EXPECT_THAT(drain(sut), ElementsAre(std::string(MessageQueue::kMaxText, 'x')));
}

TEST(MessageQueue, LosesAndMixesNothingOfManyWriters) {
  MessageQueue sut;
  constexpr int kWriters = 4;
  constexpr int kEach = 5'000;
  std::map<std::string, int> seen;
  {
    std::vector<std::jthread> writers;
    for (int w = 0; w < kWriters; ++w) {
      writers.emplace_back([&sut, text = "writer " + std::to_string(w)] {
        for (int i = 0; i < kEach; ++i) {
          while (!sut.push(0, text.c_str())) std::this_thread::yield();
        }
      });
    }
    int total = 0;
    while (total < kWriters * kEach) {
      for (const std::string& text : drain(sut)) {
        ++seen[text];
        ++total;
      }
      std::this_thread::yield();
    }
  }
  ASSERT_EQ(seen.size(), static_cast<std::size_t>(kWriters));
  for (const auto& [text, count] : seen) EXPECT_EQ(count, kEach) << text;
}

}  // namespace
}  // namespace plchost
