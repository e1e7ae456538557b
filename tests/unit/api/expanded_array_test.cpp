// The elements of arrays, as clients of a debugger ask for them.
#include "api/cli/debug/expanded_array.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

TEST(ExpandedArray, NamesItsElements) {
  const auto sut = ExpandedArray::of("Pump[].grid[][]", "ARRAY [1..2, -1..1, 0..3] OF INT");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->elements(), 24U);
  EXPECT_EQ(sut->element(0), "Pump[1].grid[-1,0]");
  EXPECT_EQ(sut->element(5), "Pump[1].grid[0,1]");
  EXPECT_EQ(sut->element(23), "Pump[2].grid[1,3]");
  EXPECT_EQ(sut->label("Pump[2].grid[1,3]"), "[2].grid[1,3]");
  EXPECT_EQ(sut->labelled("[2].grid[1,3]"), "Pump[2].grid[1,3]");
}

TEST(ExpandedArray, FindsTheNumberOfAnElement) {
  const auto sut = ExpandedArray::of("Pump[].grid[][]", "ARRAY [1..2, -1..1, 0..3] OF INT");
  ASSERT_TRUE(sut);
  const auto number = [&](std::string_view name) { return sut->number(IndexedName::parse(name).value()); };
  for (std::uint64_t i = 0; i < sut->elements(); ++i) EXPECT_EQ(number(sut->element(i)).value(), i);
  EXPECT_EQ(number("Pump[2].grid[1][3]").value(), 23U);
  for (const char* const name :
       {"Pump[2].grid[1,4]", "Pump[0].grid[1,3]", "Pump[2].grid[1]", "Pump[2].grid[1,*]"})
    EXPECT_FALSE(number(name)) << name;
  EXPECT_EQ(sut->element_type(), "INT");
}

TEST(ExpandedArray, IsNoneOfAnotherType) {
  for (const char* const type :
       {"INT", "STRING[80]", "ARRAY of nothing", "ARRAY [1] OF INT", "ARRAY [2..1] OF INT",
        "ARRAY [1..2, 3..4] OF INT", "ARRAY [1..99999999] OF INT", "ARRAY [] OF INT"})
    EXPECT_FALSE(ExpandedArray::of("a[]", type)) << type;
  EXPECT_FALSE(ExpandedArray::of("a", "ARRAY [1..2] OF INT"));
  EXPECT_TRUE(ExpandedArray::of("a[]", "ARRAY [1..2] OF STRING[80]"));
}

}  // namespace
}  // namespace plchost
