#include "manager/control/known_requests.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

using Asker = KnownRequests::Asker;

ControlRequest request(const std::string& id, ControlVerb verb = ControlVerb::start) {
  return {.number = 1, .verb = verb, .instance = "line1", .argument = "", .id = id};
}

class KnownRequestsTest : public testing::Test {
 protected:
  [[nodiscard]] bool knows(const ControlRequest& asked) { return sut_.find(asked, {}).has_value(); }
  void done(const std::string& id, ErrorCode code = ErrorCode::ok) {
    (void)sut_.end(id, {}, {.number = 1, .code = code, .text = {}}, now_);
  }
  TimePoint now_{std::chrono::hours(1)};
  KnownRequests sut_;
};

TEST_F(KnownRequestsTest, AreKnownByTheirIdAndByWhatTheyAskFor) {
  sut_.begin(request("a"), {}, now_);
  EXPECT_TRUE(knows(request("a")));
  EXPECT_FALSE(knows(request("b")));
  EXPECT_FALSE(knows(request("a", ControlVerb::stop)));
}

TEST_F(KnownRequestsTest, WithoutAnIdAreEachNew) {
  sut_.begin(request(""), {.connection = 1, .number = 1}, now_);
  EXPECT_FALSE(knows(request("")));
  const auto askers = sut_.end("", {.connection = 1, .number = 5}, {}, now_);
  ASSERT_EQ(askers.size(), 1U);
  EXPECT_EQ(askers[0].number, 5U);
}

TEST_F(KnownRequestsTest, AreForgottenLongAfterTheirAnswer) {
  sut_.begin(request("a"), {}, now_);
  done("a");
  now_ += KnownRequests::kKept;
  sut_.begin(request("b"), {}, now_);
  EXPECT_TRUE(knows(request("a")));
  now_ += std::chrono::seconds(1);
  sut_.begin(request("c"), {}, now_);
  EXPECT_FALSE(knows(request("a")));
  EXPECT_TRUE(knows(request("b"))) << "it is under way";
}

TEST_F(KnownRequestsTest, MakeRoomByTheOldestAnswerAndByNoneThatIsUnderWay) {
  for (std::size_t i = 0; i < KnownRequests::kMost; ++i) sut_.begin(request(fmt::format("{}", i)), {}, now_);
  sut_.begin(request("one more"), {}, now_);
  EXPECT_FALSE(knows(request("one more")));
  done("7");
  now_ += std::chrono::seconds(1);
  done("3");
  sut_.begin(request("one more"), {}, now_);
  EXPECT_TRUE(knows(request("one more")));
  EXPECT_TRUE(knows(request("3")));
  EXPECT_FALSE(knows(request("7")));
}

TEST_F(KnownRequestsTest, DownloadsThatHaveFailedAreTriedAgain) {
  for (const ErrorCode code : {ErrorCode::system, ErrorCode::ok}) {
    sut_.begin(request("a", ControlVerb::download_application), {}, now_);
    done("a", code);
    EXPECT_EQ(knows(request("a", ControlVerb::download_application)), code == ErrorCode::ok);
  }
}

}  // namespace
}  // namespace plchost
