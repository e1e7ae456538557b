#include "manager/system/helper_process.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <unistd.h>

namespace plchost {
namespace {

class HelperProcessTest : public testing::Test {
 protected:
  Result<void> start(const std::string& script, Duration limit = std::chrono::seconds(20)) {
    constexpr std::size_t kMostOutput = 100'000;
    return sut_.start({"/bin/sh", "-c", script}, limit, kMostOutput, [this](const HelperEnd& end) {
      ends_.push_back(end);
      reactor_->stop();
    });
  }
  HelperEnd end() {
    EXPECT_TRUE(reactor_->run());
    return ends_.empty() ? HelperEnd() : ends_.back();
  }
  [[nodiscard]] bool eventually(const std::function<bool()>& condition) {
    Reactor::Timer look(*reactor_, [this] { reactor_->stop(); });
    for (const TimePoint end = MonotonicClock::now() + std::chrono::seconds(30);
         MonotonicClock::now() < end;) {
      if (condition()) return true;
      look.set(MonotonicClock::now() + std::chrono::milliseconds(20));
      (void)reactor_->run();
    }
    return false;
  }

  std::unique_ptr<Reactor> reactor_ = Reactor::create().value();
  HelperProcess sut_{*reactor_};
  std::vector<HelperEnd> ends_;
};

TEST_F(HelperProcessTest, TellsHowItEndedAndWhatItSaid) {
  ASSERT_TRUE(start("echo said; exit 3"));
  const HelperEnd told = end();
  EXPECT_TRUE(told.in_time);
  EXPECT_EQ(told.status.describe(), "exit code 3");
  EXPECT_EQ(told.output, "said\n");
  ASSERT_TRUE(start("head -c 90000 /dev/zero"));
  EXPECT_EQ(end().output.size(), 90'000U) << "more than a pipe has room for by itself";
}

TEST_F(HelperProcessTest, DoesOneThingAtATime) {
  ASSERT_TRUE(start("sleep 1"));
  const auto second = start("exit 0");
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::busy);
  EXPECT_TRUE(end().status.success());
  EXPECT_TRUE(start("exit 0"));
  EXPECT_TRUE(end().status.success());
}

TEST_F(HelperProcessTest, IsKilledAtItsLimitWithAllThatItHasStarted) {
  HelperEnd told;
  for (Duration limit = std::chrono::milliseconds(300); told.output.empty(); limit *= 3) {
    ASSERT_LT(limit, std::chrono::minutes(1)) << "the shell does not come to its echo";
    ASSERT_TRUE(eventually([&] { return start("sleep 1000 & echo $!; wait", limit).has_value(); }));
    told = end();
  }
  EXPECT_FALSE(told.in_time);
  EXPECT_EQ(told.status.describe(), "killed by SIGKILL");
  const int child = std::stoi(told.output);
  EXPECT_TRUE(eventually([&] { return !open_process(child); })) << "init reaps it";
}

TEST_F(HelperProcessTest, ThatWasGivenUpTellsNothing) {
  ASSERT_TRUE(start("sleep 1000"));
  sut_.give_up();
  Reactor::Timer over(*reactor_, [this] { reactor_->stop(); });
  over.set(MonotonicClock::now() + std::chrono::milliseconds(500));
  EXPECT_TRUE(reactor_->run());
  EXPECT_TRUE(ends_.empty());
  EXPECT_TRUE(eventually([&] { return start("exit 0").has_value(); })) << "it has ended";
  EXPECT_TRUE(end().status.success());
}

}  // namespace
}  // namespace plchost
