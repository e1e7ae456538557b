#include "instances/runtime/variables/variable_service.hpp"

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/variables/memory_map.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(MemoryMap, AllowsWhatIsMappedAsAWhole) {
  const MemoryMap map = MemoryMap::parse(
      "1000-3000 rw-p 00000000 00:00 0\n3000-4000 r--p 00000000 00:00 0 /lib/a b\n5000-6000 ---p 00000000 "
      "00:00 0\n"
      "7000-8000 rw-s 0 00:00 0\nnonsense\n");
  EXPECT_TRUE(map.allows(0x1000, 0x2000, true));
  EXPECT_TRUE(map.allows(0x2fff, 2, false));
  EXPECT_FALSE(map.allows(0x2fff, 2, true));
  EXPECT_FALSE(map.allows(0xfff, 2, false));
  EXPECT_FALSE(map.allows(0x3fff, 2, false));
  EXPECT_FALSE(map.allows(0x5000, 1, false));
  EXPECT_TRUE(map.allows(0x7fff, 1, true));
  EXPECT_FALSE(map.allows(0x7fff, 2, true));
  EXPECT_FALSE(map.allows(0x1000, 0, false));
  EXPECT_FALSE(map.allows(~std::uintptr_t{0}, 2, false));
  EXPECT_FALSE(MemoryMap::parse("").allows(0, 1, false));
}

Plc_Variable variable(const char* name, unsigned type, void* address) {
  Plc_Variable variable{};
  variable.dwSize = sizeof variable;
  variable.pszName = name;
  variable.dwType = type;
  variable.pAddress = address;
  return variable;
}

std::string refusal(const Plc_Variable& declared) {
  const auto taken = from_declaration(declared);
  return taken ? std::string() : taken.error().message;
}

std::int16_t word = 0;

TEST(DeclaredVariable, WhatIsNotAllowedIsRefused) {
  const Plc_Variable good = variable("Main.word", PLC_TYPE_INT, &word);
  EXPECT_EQ(refusal(good), "");
  Plc_Variable bad = good;
  bad.dwSize = 8;
  EXPECT_THAT(refusal(bad), HasSubstr("dwSize 8"));
  bad = good;
  bad.pszName = nullptr;
  EXPECT_EQ(refusal(bad), "pszName is null");
  bad.pszName = "Main..word";
  EXPECT_THAT(refusal(bad), HasSubstr("variable 'Main..word': a name has 1 to 250 characters"));
  const std::string longest(PLC_MAX_SYMBOL_NAME, 'a');
  bad.pszName = longest.c_str();
  EXPECT_EQ(refusal(bad), "");
  const std::string longer = longest + "a";
  bad.pszName = longer.c_str();
  EXPECT_THAT(refusal(bad), HasSubstr("a name has 1 to 250 characters"));
  bad = good;
  bad.pAddress = nullptr;
  EXPECT_EQ(refusal(bad), "variable 'Main.word': pAddress is null");
  bad = good;
  bad.dwType = 32;
  EXPECT_THAT(refusal(bad), HasSubstr("dwType 32 is not allowed: 1 to 31 is"));
  bad = good;
  bad.dwFlags = 2;
  EXPECT_THAT(refusal(bad), HasSubstr("dwFlags 0x2 are not allowed"));
  bad = good;
  bad.dwBytes = 4;
  EXPECT_THAT(refusal(bad), HasSubstr("dwBytes 4 is not allowed: 0 or 2 is"));
  bad = good;
  bad.nDimensions = 4;
  EXPECT_THAT(refusal(bad), HasSubstr("nDimensions 4"));
  bad.nDimensions = 1;
  EXPECT_THAT(refusal(bad), HasSubstr("1 dimensions, and 0 \"[]\" in its name"));
  bad.pszName = "Main.word[]";
  bad.aDimensions[0] = {0, 3, 1};
  EXPECT_THAT(refusal(bad), HasSubstr("dwStride 1 is not allowed: 2 and more is"));
  bad.aDimensions[0] = {0, 1U << 24U, ~0U};
  EXPECT_THAT(refusal(bad), HasSubstr("dwStride is too large"));
}

TEST(VariableCollection, HasABound) {
  VariableCollection collection;
  for (unsigned i = 0; i < PLC_MAX_DECLARED_VARIABLES; ++i) {
    const std::string name = fmt::format("v{}", i);
    const Plc_Variable declared = variable(name.c_str(), PLC_TYPE_INT, &word);
    ASSERT_EQ(collection.declare(&declared), ERR_OK);
  }
  const Plc_Variable again = variable("V7", PLC_TYPE_INT, &word);
  EXPECT_EQ(collection.declare(&again), ERR_DUPLICATE);
  const Plc_Variable more = variable("w", PLC_TYPE_INT, &word);
  EXPECT_EQ(collection.declare(&more), ERR_NOMEMORY);
  EXPECT_EQ(collection.declare(nullptr), ERR_PARAMETER);
  EXPECT_EQ(collection.take().size(), PLC_MAX_DECLARED_VARIABLES);
}

/// An application with two tasks.
class VariableServiceUnderTest : public ::testing::Test {
 protected:
  VariableServiceUnderTest() {
    VariableCollection collection;
    declare(collection, variable("a.own", PLC_TYPE_INT, &own_), "One");
    declare(collection, variable("b.common", PLC_TYPE_DINT, &common_), nullptr);
    Plc_Variable many = variable("many[]", PLC_TYPE_BYTE, many_.data());
    many.nDimensions = 1;
    many.aDimensions[0] = {0, static_cast<unsigned>(many_.size()), 1};
    declare(collection, many, "Two");
    sut_.place(collection.take(), {"One", "Two"});
  }
  static void declare(VariableCollection& collection, Plc_Variable declared, const char* task) {
    declared.pszTask = task;
    ASSERT_EQ(collection.declare(&declared), ERR_OK);
  }
  std::string make(VariableOrder::Kind kind, const std::string& argument) {
    auto order = sut_.order(kind, argument);
    if (!order) return order.error().message;
    sut_.make(*order);
    return sut_.describe(*order);
  }
  void run(std::size_t task) { sut_.slots()[task].apply(); }

  std::int16_t own_ = 1;
  std::int32_t common_ = 2;
  std::array<std::uint8_t, 2000> many_{};
  VariableService sut_;
};

TEST_F(VariableServiceUnderTest, EachTaskForcesItsOwnAndThoseOfNone) {
  EXPECT_EQ(make(VariableOrder::Kind::force, "A.OWN=5"), "'a.own' is forced: 1 -> 5");
  EXPECT_EQ(make(VariableOrder::Kind::force, "b.common=6"), "'b.common' is forced: 2 -> 6");
  EXPECT_EQ(own_, 5);
  own_ = 0;
  common_ = 0;
  run(1);
  EXPECT_EQ(own_, 0);
  EXPECT_EQ(common_, 6);
  common_ = 0;
  run(0);
  EXPECT_EQ(own_, 5);
  EXPECT_EQ(common_, 6);
  EXPECT_EQ(make(VariableOrder::Kind::unforce, "a.own"), "forces end: a.own");
  own_ = 0;
  run(0);
  EXPECT_EQ(own_, 0);
  EXPECT_EQ(make(VariableOrder::Kind::unforce, "*"), "forces end: b.common");
  EXPECT_EQ(sut_.slots()[0].list, nullptr);
  EXPECT_EQ(sut_.slots()[1].list, nullptr);
}

TEST_F(VariableServiceUnderTest, ThereIsABoundOfForces) {
  for (std::size_t i = 0; i < Forces::kMost; ++i)
    ASSERT_THAT(make(VariableOrder::Kind::force, fmt::format("many[{}]=1", i)), HasSubstr("is forced")) << i;
  EXPECT_THAT(make(VariableOrder::Kind::force, "a.own=1"),
              HasSubstr("1024 variables are forced; at most 1024"));
  EXPECT_THAT(make(VariableOrder::Kind::force, "many[0]=2"), HasSubstr("is forced"));
  EXPECT_EQ(sut_.forced_values().elements.size(), Forces::kMost);
}

TEST_F(VariableServiceUnderTest, ARequestNeedsTheTableOfNow) {
  const std::string pool = own_name("service");
  EXPECT_EQ(sut_.plan({.elements = {{0, 0}}}).error().code, ErrorCode::wrong_state);
  ASSERT_TRUE(sut_.publish(pool, "line1"));
  const auto plan = sut_.plan({.stream = sut_.stream(), .elements = {{1, 0}, {0, 0}, {2, 1999}}});
  ASSERT_TRUE(plan);
  std::vector<std::byte> values(plan->bytes);
  many_[1999] = 9;
  VariableService::copy(*plan, values);
  EXPECT_THAT(values, ElementsAre(std::byte{2}, std::byte{0}, std::byte{0}, std::byte{0}, std::byte{1},
                                  std::byte{0}, std::byte{9}));
  EXPECT_EQ(sut_.plan({.stream = sut_.stream(), .elements = {{2, 2000}}}).error().code, ErrorCode::not_found);
  auto next = sut_.prepare({});
  sut_.take_over(next);
  ASSERT_TRUE(sut_.publish(pool, "line1"));
  EXPECT_EQ(sut_.stream(), 0);
  EXPECT_EQ(SymbolTable::open(pool, "line1").error().code, ErrorCode::not_found);
}

TEST_F(VariableServiceUnderTest, AnotherVersionTakesTheForcesOver) {
  (void)make(VariableOrder::Kind::force, "a.own=5");
  (void)make(VariableOrder::Kind::force, "b.common=6");
  (void)make(VariableOrder::Kind::force, "many[3]=7");
  std::int16_t own = 0;
  std::int64_t common = 0;
  VariableCollection collection;
  declare(collection, variable("A.own", PLC_TYPE_INT, &own), nullptr);
  declare(collection, variable("b.common", PLC_TYPE_LINT, &common), nullptr);
  auto next = sut_.prepare(collection.take());
  EXPECT_THAT(next.ended, ElementsAre("b.common", "many[3]"));
  sut_.take_over(next);
  run(1);
  EXPECT_EQ(own, 5);
  EXPECT_EQ(common, 0);
  EXPECT_EQ(sut_.forces().size(), 1);
  EXPECT_EQ(sut_.forced_names(), "A.own");
}

}  // namespace
}  // namespace plchost
