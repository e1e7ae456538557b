#include "shm/base/names.hpp"

#include <array>

#include <gmock/gmock.h>

namespace plchost {
namespace {

using testing::HasSubstr;

class InvalidName : public testing::TestWithParam<std::string> {};

TEST_P(InvalidName, IsRefusedWithWhatIsAllowed) {
  const auto checked = check_name("instance", GetParam(), kMaxInstanceName);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(checked.error().message, HasSubstr("instance '"));
  EXPECT_THAT(checked.error().message, HasSubstr("1 to 31 letters"));
}

INSTANTIATE_TEST_SUITE_P(Names, InvalidName,
                         testing::Values("", ".", "..", ".hidden", "-dash", "a/b", "a b", "a\n", "a*",
                                         "\xc3\xa4", std::string(1, '\0'),
                                         std::string(kMaxInstanceName + 1, 'x'), std::string(100'000, 'x')));

TEST(Names, AcceptsTheLongestAndTheShortest) {
  EXPECT_TRUE(check_name("instance", std::string(kMaxInstanceName, 'x'), kMaxInstanceName));
  EXPECT_TRUE(check_name("instance", "a", kMaxInstanceName));
  EXPECT_TRUE(check_name("instance", "Line_1-a.b", kMaxInstanceName));
}

TEST(Names, EventObjectsFitIntoThePool) {
  const auto name = event_object_name(std::string(kMaxInstanceName, 'i'), std::string(kMaxEventName, 'e'));
  EXPECT_LE(name.size(), kMaxObjectName);
  EXPECT_EQ(event_object_name("line1", "ready"), "line1/ready");
}

TEST(Names, NearestFindsTypingErrorsOnly) {
  constexpr std::array<std::string_view, 3> kKnown = {"CmpSchedule", "CmpScheduleTimer",
                                                      "CmpScheduleOneShot"};
  EXPECT_EQ(nearest_name("CmpSchedle", kKnown), "CmpSchedule");
  EXPECT_EQ(nearest_name("cmpscheduletimer", kKnown), "CmpScheduleTimer");
  EXPECT_EQ(nearest_name("zebra", kKnown), "");
  EXPECT_EQ(nearest_name("x", {}), "");
  EXPECT_EQ(nearest_name("", kKnown), "");
  static constexpr std::string_view kKeys[] = {"name", "dds_domain", "state_dir", "run_dir"};
  EXPECT_EQ(nearest_name("domain", kKeys), "dds_domain");
  EXPECT_EQ(nearest_name("state", kKeys), "state_dir");
  EXPECT_EQ(nearest_name("dir", kKeys), "");  // of two
  EXPECT_EQ(nearest_name("omain", kKeys), "");
  EXPECT_EQ(nearest_name("CmpSchedle", kKnown, 1), "CmpSchedule");
  EXPECT_EQ(nearest_name("CmpSchdle", kKnown, 1), "");
}

TEST(Names, JoinsForMessages) {
  constexpr std::array<std::string_view, 2> kTwo = {"a", "b"};
  EXPECT_EQ(join_names(kTwo), "a, b");
  EXPECT_EQ(join_names({}), "none");
}

TEST(Names, CutsBetweenCharacters) {
  EXPECT_EQ(cut("abc", 3), "abc");
  EXPECT_EQ(cut("abcd", 3), "abc");
  EXPECT_EQ(cut("ab\xc3\xa4", 3), "ab");
  EXPECT_EQ(cut("\x80\x80\x80\x80\x80\x80\x80\x80", 6).size(), 2U) << "no UTF-8 at all";
  EXPECT_EQ(cut_front("abc", 3), "abc");
  EXPECT_EQ(cut_front("abcd", 3), "bcd");
  EXPECT_EQ(cut_front("abcd", 0), "");
  EXPECT_EQ(cut_front("\xc3\xa4"
                      "bc",
                      3),
            "bc");
  EXPECT_EQ(cut_front("\x80\x80\x80\x80\x80\x80\x80\x80", 6).size(), 2U) << "no UTF-8 at all";
  EXPECT_EQ(shown(std::string(1000, 'x')).size(), kShownBytes);
}

TEST(Names, SaysThatATextIsShortened) {
  EXPECT_EQ(shortened("abcdef", 6), "abcdef");
  EXPECT_EQ(shortened("abcdefg", 6), "abc...");
  EXPECT_EQ(shortened("ab\xc3\xa4 defg", 6), "ab...") << "no torn character";
  EXPECT_EQ(shortened("abcdef", 2), "..");
}

TEST(Names, OfAStrangerAreShownWithoutWhatCouldDriveATerminalOrBreakALine) {
  EXPECT_EQ(shown("\x1b[31mline1\n"), "?[31mline1?");
  EXPECT_EQ(shown("\xc3\xa4 1"), "\xc3\xa4 1") << "printable characters stay";
  EXPECT_EQ(shown("\xc3\xa4\x1b\xc3"), "\xc3\xa4??") << "also beside others";
  EXPECT_EQ(join_some(std::vector<std::string>{"a\tb", "c"}), "a?b, c");
}

TEST(Names, AreNotPrintableWithCharactersThatChangeTheOrderOrAreNotSeen) {
  for (const std::string bad :
       {"\u202e", "\u200b", "\u2066", "\u2069", "\ufeff", "\u2028", "\u2029", "\u200f", "\u0085"}) {
    EXPECT_FALSE(is_printable_utf8("a" + bad + "b")) << bad;
    EXPECT_EQ(printable("a" + bad + "b"), "a" + std::string(bad.size(), '?') + "b");
  }
  for (const std::string good : {"\u200c", "\u200d", "\u2010", "\u2027", "\u202f", "\u2065", "\u206a",
                                 "\u20ac", "\u00a0", "\U0001f600"})
    EXPECT_TRUE(is_printable_utf8("a" + good + "b")) << good;
}

TEST(Names, JoinsTheFirstOfALongList) {
  std::vector<std::string> names(kShownNames, "a");
  EXPECT_THAT(join_some(names), testing::Not(HasSubstr("more")));
  names.resize(1000, "b");
  names[0] = std::string(1000, 'x');
  EXPECT_THAT(join_some(names), testing::EndsWith(", a and 980 more"));
  EXPECT_LT(join_some(names).size(), 200U);
  EXPECT_EQ(join_some({}), "none");
}

TEST(FixedText, CutsWhatIsTooLong) {
  FixedText<3> sut("abcdef");
  EXPECT_EQ(sut.view(), "abc");
  sut.assign("z");
  EXPECT_EQ(sut.view(), "z");
  EXPECT_EQ(sut.bytes[1], '\0');
}

TEST(FixedText, NeverReadsPastItsEnd) {
  FixedText<3> sut;
  sut.bytes.fill('x');  // as a stranger may have written it
  EXPECT_EQ(sut.view(), "xxxx");
}

TEST(CountText, HasTheNounOfItsNumber) {
  EXPECT_EQ(count_text(0, "task"), "0 tasks");
  EXPECT_EQ(count_text(1, "task"), "1 task");
  EXPECT_EQ(count_text(2, "task"), "2 tasks");
  EXPECT_EQ(count_text(1, "identity is", "identities are"), "1 identity is");
  EXPECT_EQ(count_text(3, "identity is", "identities are"), "3 identities are");
}

TEST(UnknownOption, IsNamedWithTheOneThatIsMeantAndAllThatThereAre) {
  const std::vector<std::string> options = {"-o", "--output", "--config"};
  const auto hint = [&](const std::vector<std::string>& words) { return unknown_option(words, options); };
  EXPECT_EQ(hint({"list", "--confg=x"}),
            "unknown option '--confg' (did you mean '--config'?); known are -o, --output, --config");
  EXPECT_EQ(hint({"-x"}), "unknown option '-x' (did you mean '-o'?); known are -o, --output, --config");
  EXPECT_EQ(hint({"list", "-ojson", "--output=json", "--", "--confg"}), "");
}

}  // namespace
}  // namespace plchost
