#include "shm/block_driver/link_gate.hpp"

#include <memory>

#include <gtest/gtest.h>

namespace plchost {
namespace {

struct NumberedLink {
  int number = 0;
};
using Gate = LinkGate<NumberedLink>;

class LinkGateTest : public ::testing::Test {
 protected:
  [[nodiscard]] bool exchange(int number) { return sut_.exchange(std::make_unique<NumberedLink>(number)); }

  Gate sut_;
};

TEST_F(LinkGateTest, TakesNoMoreLinksThanItCanKeepForThoseWhoAreInside) {
  ASSERT_TRUE(exchange(0));
  {
    const Gate::Use inside = sut_.enter();
    const int most = Gate::kMostRetired;
    for (int number = 1; number <= most; ++number) EXPECT_TRUE(exchange(number));
    EXPECT_FALSE(exchange(99));
    EXPECT_FALSE(sut_.exchange(nullptr));
    EXPECT_EQ(sut_.get()->number, most) << "it stays";
    EXPECT_EQ(sut_.enter()->number, most);
    EXPECT_EQ(inside->number, 0) << "the one that is in use is there";
  }
  EXPECT_TRUE(exchange(99));
  EXPECT_EQ(sut_.get()->number, 99);
}

TEST_F(LinkGateTest, IsClosedWithoutALink) {
  EXPECT_TRUE(sut_.closed());
  EXPECT_FALSE(sut_.enter());
  ASSERT_TRUE(exchange(1));
  EXPECT_FALSE(sut_.closed());
  ASSERT_TRUE(sut_.exchange(nullptr));
  EXPECT_TRUE(sut_.closed());
}

}  // namespace
}  // namespace plchost
