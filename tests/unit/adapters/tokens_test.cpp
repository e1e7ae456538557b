#include "instances/adapters/iec/tokens.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

namespace plchost::iec {
namespace {

using testing::ElementsAre;

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  for (const Token& token : tokens_of(text, "a.st").all) words.push_back(token.text);
  words.pop_back();
  return words;
}

TEST(IecTokens, AreSeparatedAsTheStandardSays) {
  EXPECT_THAT(words_of("x:=16#FF+1.5E-3;"), ElementsAre("x", ":=", "16#FF", "+", "1.5E-3", ";"));
  EXPECT_THAT(words_of("a AT %IX0.1:BOOL;"), ElementsAre("a", "AT", "%IX0.1", ":", "BOOL", ";"));
  EXPECT_THAT(words_of("ARRAY[1..10]OF INT"), ElementsAre("ARRAY", "[", "1", "..", "10", "]", "OF", "INT"));
  EXPECT_THAT(words_of("T#-1.5s DT#2026-01-02-03:04:05"), ElementsAre("T#-1.5s", "DT#2026-01-02-03:04:05"));
  EXPECT_THAT(words_of("INT#5-x"), ElementsAre("INT#5", "-", "x"));
}

TEST(IecTokens, LeaveOutComments) {
  EXPECT_THAT(words_of("a (* b *) c // d\n e /* f */ g"), ElementsAre("a", "c", "e", "g"));
}

TEST(IecTokens, HaveTextsAsOneWordWithWhatTheyHold) {
  EXPECT_THAT(words_of("'a;$'b' \"c(*\" {d := 1}"), ElementsAre("'a;$'b'", "\"c(*\"", "{d := 1}"));
}

TEST(IecTokens, KnowTheirPlace) {
  const Tokens tokens = tokens_of("a\n  (*\n*) b", "x.st");
  EXPECT_EQ(tokens.all.at(1).place, (SourcePlace{"x.st", 3, 4}));
}

TEST(IecTokens, SayWhatHasNoEnd) {
  EXPECT_EQ(describe(tokens_of("a\n (* b", "x.st").problems.at(0)), "x.st:2:2: this comment has no '*)'");
  EXPECT_EQ(describe(tokens_of("'a\nb", "x.st").problems.at(0)), "x.st:1:1: this text has no second '");
  EXPECT_EQ(describe(tokens_of("{a", "x.st").problems.at(0)), "x.st:1:1: this pragma has no '}'");
}

// The third edition counts the comments within. The second one does not, and many sources rely on it.
TEST(IecTokens, CommentsWithinCommentsCountIfAllOfThemEnd) {
  EXPECT_THAT(words_of("a (* b (* c *) d *) e"), ElementsAre("a", "e"));
  EXPECT_THAT(words_of("a (* (* b *) (* (* c *) *) d *) e (* f *) g"), ElementsAre("a", "e", "g"));
  EXPECT_THAT(words_of("a (* b (* c *) d"), ElementsAre("a", "d"));
  EXPECT_THAT(words_of("a (* b (* c *) d (* e *) f (* g (* h *) i"), ElementsAre("a", "d", "f", "i"));
  EXPECT_THAT(words_of("a (* '(*' *) b '*)' c"), ElementsAre("a", "b", "'*)'", "c"));
  EXPECT_THAT(words_of("a // *)\n (* '(*' *) /* *) */ b"), ElementsAre("a", "b"));
  EXPECT_EQ(tokens_of("a (* b (* c *) d *) (* e *)", "x.st").new_comments.size(), 1U);
  const Tokens open = tokens_of(std::string(100'000, '(') + "*" + std::string(100'000, '*'), "x.st");
  EXPECT_EQ(open.problems.size(), 1U);
}

TEST(IecTokens, SayWhereALetterIsNoneOfTheLanguage) {
  const Tokens tokens = tokens_of("(* \xC3\xA4 *) 'a\xC3\xA4'\n  z\xC3\xA4hler := 1;", "x.st");
  ASSERT_EQ(tokens.problems.size(), 1U);
  EXPECT_EQ(describe(tokens.problems.front()).substr(0, 35), "x.st:2:4: this letter is not ASCII;");
  EXPECT_LE(tokens_of(std::string(99, '\xFF') + " \xFF", "x.st").problems.size(), 2U);
}

TEST(IecTokens, CompareNamesWithoutCase) {
  const Tokens tokens = tokens_of("Program 'program'", "x.st");
  EXPECT_TRUE(tokens.all.at(0).is("PROGRAM"));
  EXPECT_FALSE(tokens.all.at(1).is("'program'"));
  EXPECT_EQ(folded("Motor_1"), "MOTOR_1");
}

}  // namespace
}  // namespace plchost::iec
