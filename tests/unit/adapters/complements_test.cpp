#include "instances/adapters/matiec/complements.hpp"

#include <string>

#include <gtest/gtest.h>

namespace plchost::matiec {
namespace {

TEST(NarrowComplements, HaveTheTypeOfTheirOperand) {
  EXPECT_EQ(with_narrow_complements("(~(__GET_VAR(data__->B,)) == 0xF0)"),
            "((__typeof__(__GET_VAR(data__->B,)))~(__GET_VAR(data__->B,)) == 0xF0)");
  EXPECT_EQ(with_narrow_complements("~((0xF & A.table[(1) - (0)]))"),
            "(__typeof__(A.table[(1) - (0)]))~((0xF & A.table[(1) - (0)]))");
  EXPECT_EQ(with_narrow_complements("~((__BYTE_LITERAL(3) ^ B))"),
            "(__typeof__(__BYTE_LITERAL(3)))~((__BYTE_LITERAL(3) ^ B))");
  EXPECT_EQ(with_narrow_complements("~(~(B))"), "(__typeof__(B))~((__typeof__(B))~(B))");
}

TEST(NarrowComplements, LeaveTheLinesAsTheyAre) {
  EXPECT_EQ(with_narrow_complements("~(SHL(\n    (BYTE)B,\n    (SINT)1)) != C"),
            "(__typeof__(SHL(     (BYTE)B,     (SINT)1)))~(SHL(\n    (BYTE)B,\n    (SINT)1)) != C");
}

TEST(NarrowComplements, OfAnotherFormAreLeftToTheCompiler) {
  for (const std::string code :
       {"", "~(0xF0)", "~(B", "~(B[", "\"~(B)\"", "'~(' + ~B", "\"\\\"~(B)\"", "~()", "\"\\"})
    EXPECT_EQ(with_narrow_complements(code), code);
}

}  // namespace
}  // namespace plchost::matiec
