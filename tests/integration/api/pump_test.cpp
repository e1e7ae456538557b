// Calls of a client that are under way at the same time.
#include "api/client/pump.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/client/inbox.hpp"
#include "api/client/turns.hpp"
#include "api/dds/domain.hpp"
#include "shm/base/result.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;

/// A pump that takes what the test has put into `come_`.
class ClientPump : public testing::Test {
 protected:
  /// Waits until the text has come.
  Async<Result<std::string>> wait_for(std::string text) {
    while (std::ranges::find(come_, text) == come_.end()) co_await sut_.change(kNoDeadline);
    log_.push_back(text);
    co_return text;
  }
  Async<Result<std::string>> wait_for_both(std::string first, std::string second) {
    PLCHOST_CO_TRY_ASSIGN(const std::string one, co_await wait_for(first));
    PLCHOST_CO_TRY_ASSIGN(const std::string other, co_await wait_for(second));
    co_return one + other;
  }
  Async<Result<std::string>> fail_behind(std::string text) {
    PLCHOST_CO_TRY(co_await wait_for(text));
    PLCHOST_CO_TRY(Result<void>(failure(ErrorCode::not_found, "nothing")));
    co_return text;
  }
  Async<Result<std::string>> throw_behind(std::string text) {
    PLCHOST_CO_TRY(co_await wait_for(text));
    throw std::runtime_error("thrown");
  }
  Async<Result<std::string>> take_turn(Turns& turns, std::string text) {
    Turns::Turn turn(turns, sut_);
    while (!turn.has_come()) co_await turn.come();
    co_return co_await wait_for(text);
  }
  /// Whether it has come at the deadline.
  Async<bool> take_turn_until(Turns& turns, TimePoint deadline) {
    Turns::Turn turn(turns, sut_);
    while (!turn.has_come() && MonotonicClock::now() < deadline) co_await turn.come(deadline);
    co_return turn.has_come();
  }
  Async<Result<std::string>> complete_within(std::string outer, std::string inner) {
    PLCHOST_CO_TRY(co_await wait_for(outer));
    coming_ = {inner};
    sut_.set().wake();
    co_return sut_.complete(wait_for(inner));
  }
  /// A round in which these come.
  void round(std::vector<std::string> texts = {}) {
    coming_ = std::move(texts);
    sut_.set().wake();
    sut_.round(soon());
  }

  OwnDomain number_;
  std::shared_ptr<dds::Entity> domain_ = [this] {
    dds::DomainOptions options;
    options.domain = number_.number();
    return dds::open_domain(dds::Role::client, options).value();
  }();
  dds::Entity participant_{dds_create_participant(number_.number(), nullptr, nullptr)};
  std::vector<std::string> coming_;
  std::vector<std::string> come_;
  std::vector<std::string> log_;
  std::vector<bool> several_;
  Pump sut_{WaitSet::create(participant_.get()).value(), [this](bool several) {
              several_.push_back(several);
              come_.insert(come_.end(), coming_.begin(), coming_.end());
              coming_.clear();
            }};
};

TEST_F(ClientPump, LetsEachCallGoOnWhenWhatItWaitsForHasCome) {
  auto a = wait_for("a");
  auto b = wait_for("b");
  a.start();
  b.start();
  round({"b"});
  EXPECT_FALSE(a.done());
  ASSERT_TRUE(b.done());
  EXPECT_EQ(b.take().value(), "b");
  round({"a"});
  ASSERT_TRUE(a.done());
  EXPECT_THAT(several_, ElementsAre(true, false));
}

TEST_F(ClientPump, GoesOnInTheOrderInWhichCallsBeganToWait) {
  auto first = wait_for_both("x", "y");
  auto second = wait_for("y");
  first.start();
  second.start();
  round({"x", "y"});
  EXPECT_THAT(log_, ElementsAre("x", "y", "y"));
  EXPECT_EQ(first.take().value(), "xy");
}

TEST_F(ClientPump, EndsAWaitAtItsDeadline) {
  const TimePoint end = MonotonicClock::now() + std::chrono::milliseconds(20);
  const auto wait = [](Pump& pump, TimePoint until) -> Async<bool> {
    while (MonotonicClock::now() < until) co_await pump.change(until);
    co_return true;
  };
  EXPECT_TRUE(sut_.complete(wait(sut_, end)));
  EXPECT_GE(MonotonicClock::now(), end);
}

TEST_F(ClientPump, TellsErrorsAndExceptionsToTheCallThatWaits) {
  auto failing = fail_behind("a");
  auto throwing = throw_behind("a");
  failing.start();
  throwing.start();
  round({"a"});
  EXPECT_EQ(failing.take().error().code, ErrorCode::not_found);
  EXPECT_THROW((void)throwing.take(), std::runtime_error);
}

TEST_F(ClientPump, ForgetsACallThatIsGivenUp) {
  auto kept = wait_for("a");
  kept.start();
  {
    auto given_up = wait_for_both("a", "b");
    given_up.start();
  }
  round({"a"});
  EXPECT_TRUE(kept.done());
  EXPECT_THAT(log_, ElementsAre("a"));
}

TEST_F(ClientPump, GoesOnWithOthersWhileACallCompletesOneOfItsOwn) {
  auto outer = complete_within("go", "inner");
  auto behind = wait_for("go");  // of the same round
  outer.start();
  behind.start();
  round({"go"});
  ASSERT_TRUE(outer.done());
  EXPECT_EQ(outer.take().value(), "inner");
  EXPECT_TRUE(behind.done());
  EXPECT_THAT(log_, ElementsAre("go", "go", "inner"));
}

TEST_F(ClientPump, GivesTurnsInTheOrderInWhichTheyWereAskedFor) {
  Turns turns;
  auto first = take_turn(turns, "first");
  auto second = take_turn(turns, "second");
  auto third = take_turn(turns, "third");
  first.start();
  second.start();
  third.start();
  second = {};  // it gives its turn up
  round({"third"});
  EXPECT_FALSE(third.done()) << "it is not its turn";
  round({"first"});
  EXPECT_TRUE(first.done());
  EXPECT_TRUE(third.done()) << "in the same round: a turn was given back";
}

TEST_F(ClientPump, DoesNotLookAtCallsWhoseTurnHasNotCome) {
  Turns turns;
  std::vector<Async<Result<std::string>>> calls;
  for (int i = 0; i < 100; ++i) {
    calls.push_back(take_turn(turns, "all"));
    calls.back().start();
  }
  round();
  round({"all"});
  EXPECT_TRUE(calls.back().done());
  EXPECT_THAT(several_, ElementsAre(false, false)) << "only one of them waits for DDS";
}

TEST_F(ClientPump, LetsATurnThatIsGivenBackOutsideOfARoundComeInTheNext) {
  Turns turns;
  auto first = take_turn(turns, "first");
  auto second = take_turn(turns, "second");
  come_ = {"second"};
  first.start();
  second.start();
  first = {};
  EXPECT_FALSE(second.done());
  sut_.round(soon());
  EXPECT_TRUE(second.done());
  EXPECT_EQ(several_.size(), 1U) << "a round always takes";
}

TEST_F(ClientPump, EndsTheWaitForATurnAtItsDeadline) {
  Turns turns;
  auto first = take_turn(turns, "first");
  first.start();
  const TimePoint end = MonotonicClock::now() + std::chrono::milliseconds(20);
  EXPECT_FALSE(sut_.complete(take_turn_until(turns, end)));
  EXPECT_GE(MonotonicClock::now(), end);
  auto third = take_turn_until(turns, kNoDeadline);
  third.start();
  round({"first"});
  EXPECT_TRUE(first.done());
  ASSERT_TRUE(third.done()) << "the second one has left the line";
  EXPECT_TRUE(third.take());
}

TEST_F(ClientPump, ForgetsACallThatIsGivenUpWhenItsTurnHasJustCome) {
  Turns turns;
  auto first = take_turn(turns, "first");
  auto second = take_turn(turns, "second");
  auto third = take_turn(turns, "third");
  first.start();
  second.start();
  third.start();
  first = {};   // the second one's turn has come
  second = {};  // before it went on
  round({"third"});
  EXPECT_TRUE(third.done());
  EXPECT_THAT(log_, ElementsAre("third"));
}

TEST(ClientInbox, KeepsAnswersOnlyToWhatIsAsked) {
  Inbox<int> sut;
  const AnswerKey asked({}, 1, "hosta");
  const AnswerKey of_another_host({}, 1, "hostb");
  sut.put(asked, [] { return 1; });
  EXPECT_FALSE(sut.expects_any());
  {
    Inbox<int>::Expected answer(sut, asked);
    sut.put(of_another_host, [] { return 2; });
    EXPECT_FALSE(answer.take_first());
    sut.put(asked, [] { return 3; });
    sut.put(asked, [] { return 4; });
    EXPECT_EQ(answer.take_first(), 3);
    EXPECT_TRUE(answer.take().empty());
  }
  EXPECT_FALSE(sut.expects_any());
}

TEST(ClientInbox, KeepsABoundedNumberOfAnswersToOneQuestion) {
  Inbox<int> sut;
  const AnswerKey asked({}, 1, "hosta");
  Inbox<int>::Expected answer(sut, asked);
  for (int i = 0; i < 1000; ++i) sut.put(asked, [i] { return i; });
  EXPECT_EQ(answer.take().size(), 64U);
}

}  // namespace
}  // namespace plchost
