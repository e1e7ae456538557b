#include "api/server/answer_memory.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

using std::chrono::seconds;

class AnswerMemoryTest : public testing::Test {
 protected:
  static dds::Guid client(std::uint16_t number) {
    dds::Guid guid;
    guid.bytes[0] = static_cast<std::uint8_t>(number);
    guid.bytes[1] = static_cast<std::uint8_t>(number >> 8);
    return guid;
  }
  static Answer reply(std::uint64_t number, ErrorCode code = ErrorCode::ok) {
    Answer made{.code = code};
    made.identity.sequence_number = static_cast<decltype(made.identity.sequence_number)>(number);
    return made;
  }
  const Answer* find(std::uint16_t of, std::uint64_t number) const {
    return sut_.find(client(of), reply(number).identity);
  }

  AnswerMemory sut_;
  TimePoint now_{seconds(1000)};
};

TEST_F(AnswerMemoryTest, GivesAClientTheAnswerItGotAndNoOther) {
  sut_.remember(client(1), reply(5, ErrorCode::timed_out), now_);
  sut_.remember(client(1), reply(5, ErrorCode::refused), now_);
  ASSERT_NE(find(1, 5), nullptr);
  EXPECT_EQ(find(1, 5)->code, ErrorCode::timed_out) << "the first one counts";
  EXPECT_EQ(find(1, 6), nullptr);
  EXPECT_EQ(find(2, 5), nullptr);
}

TEST_F(AnswerMemoryTest, KeepsTheLastOnesOfAClient) {
  for (std::uint64_t i = 1; i <= AnswerMemory::kOfClient + 1; ++i) sut_.remember(client(1), reply(i), now_);
  EXPECT_EQ(find(1, 1), nullptr);
  EXPECT_NE(find(1, 2), nullptr);
  EXPECT_NE(find(1, AnswerMemory::kOfClient + 1), nullptr);
}

TEST_F(AnswerMemoryTest, OfMoreClientsForgetsWhoAskedLongestAgo) {
  for (std::uint16_t i = 0; i < AnswerMemory::kMaxClients; ++i)
    sut_.remember(client(i), reply(1), now_ + std::chrono::milliseconds(i == 3 ? -1 : i));
  sut_.remember(client(AnswerMemory::kMaxClients), reply(1), now_ + seconds(2));
  EXPECT_EQ(sut_.clients(), AnswerMemory::kMaxClients);
  EXPECT_EQ(find(3, 1), nullptr);
  EXPECT_NE(find(0, 1), nullptr);
  sut_.remember(client(AnswerMemory::kMaxClients + 1), reply(1), now_ + AnswerMemory::kKept + seconds(1));
  EXPECT_LT(sut_.clients(), AnswerMemory::kMaxClients) << "all that is too old goes at once";
}

TEST_F(AnswerMemoryTest, OfMoreAnswersForgetsWhoAskedLongestAgo) {
  for (std::uint16_t of = 0; of < 200; ++of) {
    now_ += seconds(1);
    for (std::uint64_t i = 1; i <= AnswerMemory::kOfClient; ++i) sut_.remember(client(of), reply(i), now_);
    ASSERT_LE(sut_.answers(), AnswerMemory::kMost);
  }
  EXPECT_EQ(find(0, 1), nullptr);
  EXPECT_NE(find(199, 1), nullptr);
  EXPECT_GE(sut_.answers(), AnswerMemory::kMost - AnswerMemory::kOfClient);
}

}  // namespace
}  // namespace plchost
