#include "instances/runtime/instance/application_state.hpp"

#include <string>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>

namespace plchost {
namespace {

using enum ApplicationState;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::array kStates = {none, stopped, running, single_cycle, stopping, exception};

class Life : public testing::Test {
 protected:
  /// One that was led to this state by arrows of the picture.
  void lead_to(ApplicationState state) {
    const auto go = [&](ApplicationState to) { ASSERT_TRUE(sut_.go_to(to, "led there")); };
    if (state == none) return;
    go(stopped);
    if (state == stopping || state == exception) go(running);
    if (state != stopped) go(state);
  }
  [[nodiscard]] ErrorCode code(ControlVerb verb) const {
    const auto admitted = sut_.admit(verb);
    return admitted ? ErrorCode::ok : admitted.error().code;
  }
  [[nodiscard]] std::string text(ControlVerb verb) const {
    const auto admitted = sut_.admit(verb);
    return admitted ? *admitted : admitted.error().message;
  }

  std::vector<std::tuple<ApplicationState, ApplicationState, std::string>> recorded_;
  ApplicationLife sut_{[this](ApplicationState from, ApplicationState to, std::string_view reason) {
    recorded_.emplace_back(from, to, reason);
  }};
};

struct Admission {
  ControlVerb verb;
  std::array<ErrorCode, 6> codes;  // in the order of kStates
};

class EachVerb : public Life, public testing::WithParamInterface<Admission> {};

TEST_P(EachVerb, IsAdmittedAsTheTableSays) {
  for (std::size_t i = 0; i < kStates.size(); ++i) {
    sut_ = ApplicationLife([](ApplicationState, ApplicationState, std::string_view) {});
    lead_to(kStates[i]);
    ASSERT_EQ(sut_.state(), kStates[i]);
    EXPECT_EQ(code(GetParam().verb), GetParam().codes[i])
        << to_string(GetParam().verb) << " in " << to_string(kStates[i]) << ": " << text(GetParam().verb);
    EXPECT_EQ(text(GetParam().verb).empty(),
              code(GetParam().verb) == ErrorCode::ok &&
                  !(kStates[i] == exception && GetParam().verb == ControlVerb::stop));
  }
}

constexpr auto kOk = ErrorCode::ok;
constexpr auto kWrong = ErrorCode::wrong_state;
constexpr auto kBusy = ErrorCode::busy;
INSTANTIATE_TEST_SUITE_P(
    Verbs, EachVerb,
    testing::Values(Admission{ControlVerb::start, {kWrong, kOk, kWrong, kBusy, kBusy, kWrong}},
                    Admission{ControlVerb::stop, {kWrong, kWrong, kOk, kOk, kBusy, kOk}},
                    Admission{ControlVerb::single_cycle, {kWrong, kOk, kWrong, kBusy, kBusy, kWrong}},
                    Admission{ControlVerb::set_scheduler, {kOk, kOk, kOk, kBusy, kBusy, kWrong}},
                    Admission{ControlVerb::change_application, {kWrong, kOk, kOk, kBusy, kBusy, kWrong}},
                    Admission{ControlVerb::status, {kOk, kOk, kOk, kOk, kOk, kOk}},
                    Admission{ControlVerb::register_event, {kOk, kOk, kOk, kOk, kOk, kOk}}));

TEST_F(Life, RecordsEachChangeOnce) {
  EXPECT_TRUE(sut_.go_to(stopped, "loaded"));
  EXPECT_TRUE(sut_.go_to(running, "start"));
  EXPECT_FALSE(sut_.go_to(running, "start again"));
  EXPECT_TRUE(sut_.go_to(exception, "division by zero"));
  EXPECT_FALSE(sut_.go_to(exception, "another one"));
  EXPECT_THAT(recorded_,
              ElementsAre(std::tuple(none, stopped, "loaded"), std::tuple(stopped, running, "start"),
                          std::tuple(running, exception, "division by zero")));
}

TEST_F(Life, RecordsWhatLeavesItInItsState) {
  lead_to(running);
  recorded_.clear();
  sut_.stay("online change");
  EXPECT_EQ(sut_.state(), running);
  EXPECT_THAT(recorded_, ElementsAre(std::tuple(running, running, "online change")));
}

TEST_F(Life, LeavesAnExceptionByNoWay) {
  lead_to(exception);
  for (const ApplicationState state : kStates) EXPECT_FALSE(sut_.go_to(state, "")) << to_string(state);
  EXPECT_EQ(sut_.state(), exception);
}

TEST_F(Life, BeginsToRunOnlyFromStopped) {
  for (const ApplicationState state : {none, running, stopping, exception}) {
    sut_ = ApplicationLife([](ApplicationState, ApplicationState, std::string_view) {});
    lead_to(state);
    EXPECT_FALSE(sut_.go_to(running, "")) << to_string(state);
    EXPECT_FALSE(sut_.go_to(single_cycle, "")) << to_string(state);
  }
}

TEST_F(Life, SaysWhatHappenedAndWhatIsPossibleInException) {
  (void)sut_.go_to(stopped, "loaded");
  (void)sut_.go_to(running, "start");
  (void)sut_.go_to(exception, "task 'Main': division by zero");
  EXPECT_THAT(text(ControlVerb::start), HasSubstr("division by zero; reset it first"));
  EXPECT_THAT(text(ControlVerb::stop), HasSubstr("division by zero; reset it to go on"));
  EXPECT_EQ(sut_.problem(), "task 'Main': division by zero");
}

}  // namespace
}  // namespace plchost
