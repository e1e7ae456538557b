#include "api/dds/gate/source_table.hpp"

#include <cstring>

#include <gtest/gtest.h>

namespace plchost::dds {
namespace {

using namespace std::chrono_literals;

class SourceTableTest : public testing::Test {
 protected:
  bool is_its_own(std::uint32_t participant, std::uint16_t port) {
    std::array<std::byte, kGuidPrefix> prefix{};
    std::memcpy(prefix.data(), &participant, sizeof participant);
    return sut_.is_its_own(prefix, port, now_);
  }

  SourceTable sut_;
  TimePoint now_{1h};
};

TEST_F(SourceTableTest, AParticipantSendsFromOnePort) {
  EXPECT_TRUE(is_its_own(1, 40000));
  EXPECT_TRUE(is_its_own(1, 40000));
  EXPECT_FALSE(is_its_own(1, 40001));
  EXPECT_TRUE(is_its_own(2, 40001));
  EXPECT_TRUE(is_its_own(1, 40000));
}

TEST_F(SourceTableTest, ForgetsAParticipantThatIsSilentAndNoOther) {
  EXPECT_TRUE(is_its_own(1, 40000));
  now_ += SourceTable::kForgotten;
  EXPECT_TRUE(is_its_own(1, 40000));
  now_ += SourceTable::kForgotten;
  EXPECT_FALSE(is_its_own(1, 40001)) << "packets of others in its name do not keep it, and take nothing";
  now_ += 1ns;
  EXPECT_TRUE(is_its_own(1, 40001));
}

TEST_F(SourceTableTest, ParticipantsThatAreMadeUpDisplaceNoneThatIsHeardAgain) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(is_its_own(1, 40000));
    now_ += 1ms;
  }
  for (std::uint32_t made_up = 1000; made_up < 101'000; ++made_up) {
    now_ += 1us;
    ASSERT_TRUE(is_its_own(made_up, 40001));
  }
  EXPECT_FALSE(is_its_own(1, 40001));
  EXPECT_TRUE(is_its_own(1, 40000));
}

}  // namespace
}  // namespace plchost::dds
