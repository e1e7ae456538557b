#include "instances/runtime/time/system_time.hpp"

#include <array>
#include <bit>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/base/time.hpp"

namespace plchost {
namespace {

using ::testing::HasSubstr;

constexpr std::array<PF_SYSTIME, 2> kOwn = {SysTimeGetUs, SysTimeGetNs};

RTS_SYSTIME now_ns() {
  return static_cast<RTS_SYSTIME>(MonotonicClock::now().time_since_epoch().count());
}

RTS_RESULT good_ns(RTS_SYSTIME* time) {
  *time = now_ns() + 5'000'000'000'000;
  return ERR_OK;
}
RTS_RESULT good_us(RTS_SYSTIME* time) {
  *time = (now_ns() + 5'000'000'000'000) / 1000;
  return ERR_OK;
}
RTS_RESULT other_base(RTS_SYSTIME* time) {
  *time = now_ns() / 1000;
  return ERR_OK;
}
RTS_RESULT failing(RTS_SYSTIME* /*time*/) {
  return ERR_FAILED;
}
RTS_RESULT still(RTS_SYSTIME* time) {
  *time = 7'000'000;
  return ERR_OK;
}
RTS_RESULT still_us(RTS_SYSTIME* time) {
  *time = 7'000;
  return ERR_OK;
}
RTS_RESULT backwards(RTS_SYSTIME* time) {
  static int calls = 0;
  *time = now_ns() + 5'000'000'000'000 - (++calls % 2 == 0 ? 1'000'000'000 : 0);
  return ERR_OK;
}
// Both a thousandth: they agree with each other.
RTS_RESULT us_as_ns(RTS_SYSTIME* time) {
  *time = now_ns() / 1000;
  return ERR_OK;
}
RTS_RESULT ms_as_us(RTS_SYSTIME* time) {
  *time = now_ns() / 1'000'000;
  return ERR_OK;
}

// A caller that loses the processor behind its first reading, and before each tenth.
constexpr auto kLost = std::chrono::milliseconds(30);
int late_calls = 0;
RTS_RESULT late(PF_SYSTIME clock, RTS_SYSTIME* time) {
  if (++late_calls % 10 == 0) std::this_thread::sleep_for(kLost);
  const RTS_RESULT result = clock(time);
  if (late_calls == 1) std::this_thread::sleep_for(kLost);
  return result;
}
RTS_RESULT late_good_ns(RTS_SYSTIME* time) {
  return late(good_ns, time);
}
RTS_RESULT late_us_as_ns(RTS_SYSTIME* time) {
  return late(us_as_ns, time);
}

std::string refusal(PF_SYSTIME us, PF_SYSTIME ns) {
  for (;;) {  // a machine that stands still for the second that is watched lets a wrong clock through
    const TimePoint begun = MonotonicClock::now();
    const auto checked = check_system_time({"MyUs", us}, {"MyNs", ns});
    if (!checked) return checked.error().message;
    if (MonotonicClock::now() - begun < std::chrono::milliseconds(900)) return "";
  }
}

TEST(SystemTime, TakesTwoFunctionsOfOneBase) {
  EXPECT_EQ(refusal(good_us, good_ns), "");
}

TEST(SystemTime, TakesARightClockWhateverTakesTheProcessorAway) {
  late_calls = 0;
  EXPECT_EQ(refusal(good_us, late_good_ns), "");
}

TEST(SystemTime, FindsAWrongPaceWhateverTakesTheProcessorAway) {
  late_calls = 0;
  EXPECT_THAT(refusal(ms_as_us, late_us_as_ns), HasSubstr("MyNs advanced by"));
}

TEST(SystemTime, RefusesWhatApplicationsCouldNotRelyOn) {
  EXPECT_THAT(refusal(other_base, good_ns), HasSubstr("MyUs and MyNs have no common base"));
  EXPECT_THAT(refusal(failing, good_ns), HasSubstr("MyUs returned 0x0001, not ERR_OK"));
  EXPECT_THAT(refusal(good_us, backwards), HasSubstr("MyNs went back from"));
  EXPECT_THAT(refusal(still_us, still), HasSubstr("MyNs stays at 7000000"));
  EXPECT_THAT(refusal(ms_as_us, us_as_ns), HasSubstr("MyNs advanced by"));
}

TEST(SystemTime, IsClockMonotonicInAllThreeUnitsByDefault) {
  ASSERT_TRUE(use_system_time({}, kOwn));
  const RTS_SYSTIME before = now_ns();
  RTS_SYSTIME us = 0;
  RTS_SYSTIME ns = 0;
  ASSERT_EQ(SysTimeGetUs(&us), ERR_OK);
  const unsigned int ms = SysTimeGetMs();
  ASSERT_EQ(SysTimeGetNs(&ns), ERR_OK);
  EXPECT_GE(us, before / 1000);
  EXPECT_LE(us, ns / 1000);
  EXPECT_GE(ns, before);
  EXPECT_LE(ns, now_ns());
  EXPECT_LE(ms - static_cast<unsigned int>(before / 1'000'000),
            static_cast<unsigned int>((now_ns() - before) / 1'000'000 + 1));
  EXPECT_EQ(SysTimeGetUs(nullptr), ERR_PARAMETER);
  EXPECT_EQ(SysTimeGetNs(nullptr), ERR_PARAMETER);
}

TEST(SystemTime, NamesTheLibraryThatIsNotThereAndTheSymbolThatItLacks) {
  const auto absent =
      use_system_time({.get_us = "a", .get_ns = "b", .library = "/nonexistent/clock.so"}, kOwn);
  ASSERT_FALSE(absent);
  EXPECT_THAT(absent.error().message, HasSubstr("/nonexistent/clock.so"));
  const auto lacking = use_system_time({.get_us = "my_us", .get_ns = "my_ns", .library = "libm.so.6"}, kOwn);
  ASSERT_FALSE(lacking);
  EXPECT_THAT(lacking.error().message, HasSubstr("libm.so.6 has no function 'my_us'"));
}

TEST(SystemTime, NamesTheKeyOfTheLibraryIfNothingThatIsLoadedHasTheSymbol) {
  const auto sut =
      use_system_time({.get_us = "MySysTimeGetUs", .get_ns = "MySysTimeGetNs", .library = ""}, kOwn);
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, ErrorCode::not_found);
  EXPECT_THAT(sut.error().message, HasSubstr("has a function 'MySysTimeGetUs'"));
  EXPECT_THAT(sut.error().message, HasSubstr("CustomSysTimeLibrary names"));
}

TEST(SystemTime, RefusesVariablesAndItself) {
  const SysTimeSettings settings{.get_us = "a", .get_ns = "b", .library = ""};
  EXPECT_THAT(
      use_system_time({.get_us = "environ", .get_ns = "environ", .library = ""}, kOwn).error().message,
      HasSubstr("'environ' is no function"));
  const auto itself = [](const char*) { return std::bit_cast<void*>(&SysTimeGetUs); };
  EXPECT_THAT(use_system_time(settings, kOwn, itself).error().message, HasSubstr("'a' is the runtime's own"));
}

}  // namespace
}  // namespace plchost
