#include "instances/adapters/matiec/loops.hpp"

#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace plchost::matiec {
namespace {

std::string loop(const std::string& condition) {
  return fmt::format("  {{\n    int __do_increment = 0;\n    while( {} ) {{\n      if(__do_increment){{\n",
                     condition);
}
// As iec2c writes it.
std::string by(const std::string& step, const std::string& variable, const std::string& end) {
  return fmt::format("(({0}) > 0)? ({1} + ({0}) <= ({2})) : ({1} + ({0}) >= ({2})) ", step, variable, end);
}

TEST(FirstTurns, AreThoseOfLoopsThatBeginAtTheirEnd) {
  EXPECT_EQ(with_first_turns(loop("I < 1")), loop("!__do_increment ? (I <= 1) : (I < 1)"));
  const std::string variable = "__GET_VAR(data__->I,)";
  const std::string end = "(A < B ? F(\n      (INT)2) : G[1 < 2])";
  EXPECT_EQ(with_first_turns(loop(variable + " < " + end)),
            loop(fmt::format("!__do_increment ? ({0} <= (A < B ? F(       (INT)2) : G[1 < 2])) : ({0} < {1})",
                             variable, end)));
}

TEST(FirstTurns, AreThoseOfLoopsWithAStep) {
  const std::string variable = "K.table[(1) + (2)]";
  const std::string end = "F(\")\\\" (\", 3)";
  for (const std::string step : {"-2", "__GET_VAR(data__->B,)"}) {
    const std::string condition = by(step, variable, end);
    EXPECT_EQ(with_first_turns(loop(condition)),
              loop(fmt::format("!__do_increment ? ((({0}) > 0)? ({1} <= ({2})) : ({1} >= ({2}))) : ({3})",
                               step, variable, end, condition)))
        << step;
  }
}

TEST(FirstTurns, StandInLoopsWithinLoops) {
  const std::string inner = loop("J < 3");
  const std::string made = with_first_turns(loop("I < 2") + inner);
  EXPECT_EQ(made,
            loop("!__do_increment ? (I <= 2) : (I < 2)") + loop("!__do_increment ? (J <= 3) : (J < 3)"));
}

TEST(FirstTurns, OfLoopsOfAnotherFormAreLeftToTheCompiler) {
  for (const std::string& code :
       {loop("I <= 1"), loop("((A) > 1)? (x) : (y)"), std::string("int __do_increment = 0;"),
        std::string("int __do_increment = 0;\nwhile( I < 1"), std::string("while( I < 1 ) {"), std::string()})
    EXPECT_EQ(with_first_turns(code), code);
}

}  // namespace
}  // namespace plchost::matiec
