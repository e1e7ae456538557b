// The decision after each end of an instance, under each policy, after each history: as one table.
#include "manager/supervisor/restart_decision.hpp"

#include <array>
#include <set>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Action = Decision::Action;

constexpr TimePoint kNow{seconds(1000)};

InstanceConfig policy_of(RestartPolicy restart, bool autostart = true) {
  InstanceConfig config;
  config.restart = restart;
  config.autostart = autostart;
  config.restart_delay = milliseconds(100);
  config.restart_delay_max = seconds(5);
  config.crash_limit = 3;
  config.crash_window = seconds(10);
  return config;
}

RestartHistory after_crashes(std::uint32_t count) {
  RestartHistory history;
  for (std::uint32_t i = count; i > 0; --i) history.crashes.push_back(kNow - seconds(i));
  history.in_a_row = count;
  return history;
}

std::string_view word(Action action) {
  constexpr std::array<std::string_view, 9> kWords = {"leave",      "start now", "start earlier",
                                                      "in order",   "back off",  "await process",
                                                      "bring down", "offline",   "fail"};
  return kWords.at(static_cast<std::size_t>(action));
}

// "back off 100 ms", "fail safe": "safe" if the next process has no application.
std::string text(const Decision& decision) {
  std::string text(word(decision.action));
  if (decision.action == Action::back_off || decision.action == Action::await_process) {
    text += fmt::format(" {} ms", std::chrono::duration_cast<milliseconds>(decision.delay).count());
  }
  return text + (decision.history.safe_mode ? " safe" : "");
}

// After no crash, one and two in a row; the third one reaches the limit. One text if all are the same.
std::string outcomes(const End& end, const InstanceConfig& policy) {
  std::string all;
  std::set<std::string> different;
  for (std::uint32_t before = 0; before < 3; ++before) {
    const std::string one = text(decide(end, after_crashes(before), policy));
    all += (before == 0 ? "" : ", ") + one;
    different.insert(one);
  }
  return different.size() == 1 ? *different.begin() : all;
}

constexpr std::string_view kCrash = "back off 100 ms, back off 200 ms, back off 400 ms safe";
constexpr std::string_view kFailure = "back off 100 ms, back off 200 ms, back off 400 ms";
constexpr std::string_view kOffline = "offline, offline, offline safe";
constexpr std::string_view kFail = "fail, fail, fail safe";

struct DecisionCase {
  EndCause cause;
  std::string_view never;
  std::string_view on_failure;
  std::string_view always;
  std::string_view stopped;      // by an operator while it had no process; under on_failure, as the next ones
  std::string_view removed;      // from the configuration
  std::string_view unwanted;     // no operator has started it, nor does the configuration
  std::string_view has_earlier;  // an application that has just been loaded did not come up
};

// clang-format off
constexpr std::array<DecisionCase, kEndCauses> kDecisionCases = {{
    {EndCause::exited, "fail", kCrash, kCrash, kOffline, kFail, kCrash, "start earlier"},
    {EndCause::killed, "fail", kCrash, kCrash, kOffline, kFail, kCrash, "start earlier"},
    {EndCause::unknown, "fail", kCrash, kCrash, kOffline, kFail, kCrash, "start earlier"},
    {EndCause::unwatched, "fail", kCrash, kCrash, kOffline, kFail, kOffline, kCrash},
    {EndCause::start_refused, "fail", "fail", kFailure, "offline", "fail", "fail", "start earlier"},
    {EndCause::start_transient, "fail", kFailure, kFailure, "offline", "fail", kFailure, kFailure},
    {EndCause::declaration_taken, "fail", kFailure, kFailure, "offline", "fail", kFailure, "start earlier"},
    {EndCause::limit_met, "fail", kFailure, kFailure, "offline", "fail", kFailure, "start earlier"},
    {EndCause::name_taken, kFailure, kFailure, kFailure, "offline", "fail", kFailure, kFailure},
    {EndCause::exception, "leave", "leave", "leave", "leave", "leave", "leave", "leave"},
    {EndCause::silent, "leave", "leave", "leave", "leave", "leave", "leave", "leave"},
    {EndCause::adoption_unanswered, "leave", "leave", "leave", "leave", "leave", "leave", "leave"},
    {EndCause::idle, "leave", "leave", "leave", "leave", "bring down", "leave", "leave"},
    {EndCause::operators_stop, "leave", "leave", "leave", "leave", "bring down", "leave", "leave"},
    {EndCause::stop_of_waiting, "offline", "offline", "offline", "offline", "offline", "offline", "offline"},
    {EndCause::replaced, "start now", "start now", "start now", "start now", "start now", "start now", "start now"},
    {EndCause::told_to_end, "offline", "offline", "offline", "offline", "offline", "offline", "offline"},
    {EndCause::manager_ends, "bring down", "bring down", "bring down", "bring down", "bring down", "bring down", "bring down"},
    {EndCause::never_begun, "in order", "in order", "in order", "leave", "leave", "leave", "in order"},
    {EndCause::without_process, "in order", "in order", "in order", "offline", "offline", "offline", "in order"},
    {EndCause::setting_up_unknown, "await process 100 ms", "in order", "in order", "offline", "offline", "offline", "in order"},
    {EndCause::host_ended, "in order", "in order", "in order", "offline", "offline", "offline", "in order"},
    {EndCause::given_up, "fail", "fail", "fail", "fail", "fail", "fail", "fail"},
    {EndCause::wish_unreadable, "fail", "fail", "fail", "fail", "fail", "fail", "fail"},
    {EndCause::reconfigured, "in order", "in order", "in order", "leave", "leave", "leave", "in order"},
}};
// clang-format on

TEST(Decide, FollowsTheTable) {
  const InstanceConfig never = policy_of(RestartPolicy::never);
  const InstanceConfig on_failure = policy_of(RestartPolicy::on_failure);
  const InstanceConfig always = policy_of(RestartPolicy::always);
  const InstanceConfig no_autostart = policy_of(RestartPolicy::on_failure, false);
  for (std::size_t i = 0; i < kDecisionCases.size(); ++i) {
    const DecisionCase& wanted = kDecisionCases.at(i);
    SCOPED_TRACE(fmt::format("row {}", i));
    ASSERT_EQ(static_cast<std::size_t>(wanted.cause), i);
    const End end{.cause = wanted.cause, .at = kNow};
    EXPECT_EQ(outcomes(end, never), wanted.never);
    EXPECT_EQ(outcomes(end, on_failure), wanted.on_failure);
    EXPECT_EQ(outcomes(end, always), wanted.always);
    EXPECT_EQ(outcomes(end, no_autostart), wanted.unwanted);
    EXPECT_EQ(outcomes({.cause = wanted.cause, .order = Order::no_process, .at = kNow}, on_failure),
              wanted.stopped);
    EXPECT_EQ(outcomes({.cause = wanted.cause, .at = kNow, .removed = true}, on_failure), wanted.removed);
    EXPECT_EQ(outcomes({.cause = wanted.cause, .at = kNow, .has_earlier = true}, on_failure),
              wanted.has_earlier);
  }
}

TEST(Decide, NeverStartsWithItsHostOnlyIfTheConfigurationSaysSo) {
  const InstanceConfig policy = policy_of(RestartPolicy::never, false);
  EXPECT_EQ(outcomes({.cause = EndCause::host_ended, .order = Order::run, .at = kNow}, policy), "fail");
}

// Over every cause, policy, autostart, history, and whatever else is said of the end.
template <typename Check>
void for_each_end(Order order, const Check& check) {
  for (std::uint8_t cause = 0; cause < kEndCauses; ++cause) {
    for (const RestartPolicy restart :
         {RestartPolicy::never, RestartPolicy::on_failure, RestartPolicy::always}) {
      for (std::uint32_t bits = 0; bits < 32; ++bits) {
        const End end{.cause = static_cast<EndCause>(cause),
                      .order = order,
                      .at = kNow,
                      .lasted = seconds((bits & 1U) != 0 ? 20 : 0),
                      .removed = (bits & 2U) != 0};
        RestartHistory history = after_crashes((bits & 4U) != 0 ? 2 : 0);
        history.safe_mode = (bits & 8U) != 0;
        SCOPED_TRACE(fmt::format("cause {}, bits {:05b}", cause, bits));
        const InstanceConfig policy = policy_of(restart, (bits & 16U) != 0);
        check(end, policy, decide(end, history, policy));
      }
    }
  }
}

bool starts(Action action) {
  return action == Action::start_now || action == Action::start_in_order || action == Action::back_off ||
         action == Action::start_earlier || action == Action::await_process;
}

TEST(Decide, StartsNothingThatAnOperatorStoppedWithoutProcessUnlessAnOperatorDoes) {
  for_each_end(Order::no_process, [](const End& end, const InstanceConfig&, const Decision& decision) {
    EXPECT_EQ(starts(decision.action), end.cause == EndCause::replaced);
  });
}

// As when a manager begins, or an adopted process ends of which nobody knows whether it was to run.
TEST(Decide, StartsNothingThatNobodyHasStartedUnlessTheConfigurationDoes) {
  for_each_end(Order::none, [](const End& end, const InstanceConfig& policy, const Decision& decision) {
    const bool begins = end.cause == EndCause::unwatched || end.cause >= EndCause::never_begun;
    EXPECT_FALSE(begins && !policy.autostart && starts(decision.action));
  });
}

TEST(Decide, LetsNoApplicationRunThatAnOperatorStopped) {
  for_each_end(Order::stop, [](const End&, const InstanceConfig&, const Decision& decision) {
    EXPECT_FALSE(decision.runs);
  });
  for_each_end(Order::no_process, [](const End&, const InstanceConfig&, const Decision& decision) {
    EXPECT_FALSE(decision.runs);
  });
  for_each_end(Order::run, [](const End&, const InstanceConfig&, const Decision& decision) {
    EXPECT_TRUE(decision.runs);
  });
}

TEST(Decide, LeavesSafeModeOnlyByAnOperator) {
  RestartHistory safe;
  safe.safe_mode = true;
  for (std::uint8_t cause = 0; cause < kEndCauses; ++cause) {
    const End end{.cause = static_cast<EndCause>(cause), .order = Order::run, .at = kNow};
    const Decision decision = decide(end, safe, policy_of(RestartPolicy::always));
    EXPECT_EQ(decision.history.safe_mode, end.cause != EndCause::replaced) << int{cause};
  }
}

TEST(Decide, CountsCrashesWithinTheWindowOnly) {
  RestartHistory history = after_crashes(0);
  history.crashes = {kNow - seconds(11), kNow - seconds(9)};
  const Decision decision =
      decide({.cause = EndCause::killed, .at = kNow}, history, policy_of(RestartPolicy::always));
  EXPECT_EQ(decision.history.crashes, (std::vector<TimePoint>{kNow - seconds(9), kNow}));
  EXPECT_FALSE(decision.history.safe_mode);
}

TEST(Decide, BacksOffFromTheBeginningAfterAWholeWindowWithoutAnEnd) {
  const InstanceConfig policy = policy_of(RestartPolicy::always);
  RestartHistory history;
  history.in_a_row = 4;
  const auto delay_after = [&](Duration lasted) {
    return decide({.cause = EndCause::exited, .at = kNow, .lasted = lasted}, history, policy).delay;
  };
  EXPECT_EQ(delay_after(seconds(9)), milliseconds(1600));
  EXPECT_EQ(delay_after(seconds(10)), milliseconds(100));
  history.in_a_row = 4'000'000'000;
  EXPECT_EQ(delay_after(Duration::zero()), seconds(5));
}

TEST(Decide, LeavesTheHistoryOfWhatIsNoFailureAlone) {
  const RestartHistory before = after_crashes(2);
  for (const EndCause cause : {EndCause::exception, EndCause::operators_stop, EndCause::manager_ends,
                               EndCause::host_ended, EndCause::adoption_unanswered}) {
    EXPECT_EQ(decide({.cause = cause, .at = kNow}, before, policy_of(RestartPolicy::always)).history, before);
  }
  EXPECT_EQ(
      decide({.cause = EndCause::replaced, .at = kNow}, before, policy_of(RestartPolicy::always)).history,
      RestartHistory());
}

TEST(CauseOf, TellsAnExitFromASignalAndFromWhatNobodyCanKnow) {
  EXPECT_EQ(cause_of({.kind = ExitStatus::Kind::exited, .value = 0}), EndCause::exited);
  EXPECT_EQ(cause_of({.kind = ExitStatus::Kind::exited, .value = 3}), EndCause::exited);
  EXPECT_EQ(cause_of({.kind = ExitStatus::Kind::killed, .value = 9}), EndCause::killed);
  EXPECT_EQ(cause_of({.known = false}), EndCause::unknown);
}

TEST(RestoredHistory, KeepsWhatLiesWithinTheWindowAndTakesAFutureCrashForAYoungOne) {
  const RestartHistory history = restored_history(kNow, {seconds(11), seconds(4), -seconds(60)}, 7, true,
                                                  policy_of(RestartPolicy::always));
  EXPECT_EQ(history.crashes, (std::vector<TimePoint>{kNow - seconds(4), kNow}));
  EXPECT_EQ(history.in_a_row, 7U);
  EXPECT_TRUE(history.safe_mode);
}

}  // namespace
}  // namespace plchost
