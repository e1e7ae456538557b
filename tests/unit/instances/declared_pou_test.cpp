#include "instances/runtime/debug/declared_pou.hpp"

#include <array>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/plc_variables.h"

namespace plchost {
namespace {

using testing::HasSubstr;

class DeclaredPous : public testing::Test {
 protected:
  RTS_RESULT declare(const char* name, const char* file, std::vector<unsigned> lines,
                     const std::vector<Plc_Local>& locals = {},
                     const std::vector<Plc_LocalArray>& arrays = {}) {
    lines_.push_back(std::move(lines));
    pous_.push_back({sizeof(Plc_Pou), name, file, lines_.back().data(),
                     static_cast<unsigned>(lines_.back().size()), 0, locals.data(),
                     static_cast<unsigned>(locals.size()), arrays.data(),
                     static_cast<unsigned>(arrays.size())});
    return sut.declare(&pous_.back());
  }

  static std::optional<LocalElement> whole(std::uint32_t local) { return LocalElement{.local = local}; }

  PouCollection sut;
  std::deque<Plc_Pou> pous_;
  std::deque<std::vector<unsigned>> lines_;
};

TEST_F(DeclaredPous, AreFoundByNameAndByFile) {
  ASSERT_EQ(declare("Main", "src/main.st", {5, 9}), ERR_OK);
  ASSERT_EQ(declare("Motor", "src/main.st", {20, 22}), ERR_OK);
  ASSERT_EQ(declare("Pump", "src/pump.st", {3}), ERR_OK);
  EXPECT_EQ(sut.find("Main:5").value(), (PouLine{0, 5}));
  EXPECT_EQ(sut.find("main:6").value(), (PouLine{0, 9}));
  EXPECT_EQ(sut.find("MOTOR").value(), (PouLine{1, 20}));
  EXPECT_EQ(sut.find("main.st:10").value(), (PouLine{1, 20}));
  EXPECT_EQ(sut.find("main.st:22").value(), (PouLine{1, 22}));
  EXPECT_EQ(sut.find("src/pump.st:1").value(), (PouLine{2, 3}));
  EXPECT_THAT(sut.find("Main:10").error().message, HasSubstr("its last is in line 9"));
  EXPECT_THAT(sut.find("main.st:23").error().message, HasSubstr("no statement from line 23 on"));
  EXPECT_THAT(sut.find("pomp.st:1").error().message, HasSubstr("pump.st"));
  EXPECT_THAT(sut.find("Valve").error().message, HasSubstr("Main, Motor, Pump"));
  EXPECT_THAT(sut.find("other/pump.st:1").error().message, HasSubstr("no POU or file"));
  for (const char* const place : {"Main:", "Main:0", "Main:x", ":", "Main:5 "})
    EXPECT_FALSE(sut.find(place)) << place;
}

TEST_F(DeclaredPous, OfFilesOfOneNameAreFoundByTheirFolders) {
  ASSERT_EQ(declare("Fill", "a/same.st", {2, 9}), ERR_OK);
  ASSERT_EQ(declare("Cap", "b/same.st", {3, 7}), ERR_OK);
  EXPECT_EQ(sut.find("b/same.st:2").value(), (PouLine{1, 3}));
  EXPECT_EQ(sut.find("/src/b/same.st:2").value(), (PouLine{1, 3}));
  EXPECT_EQ(sut.find("/src/a/same.st:3").value(), (PouLine{0, 9}));
  EXPECT_THAT(sut.find("/src/b/same.st:8").error().message, HasSubstr("no statement from line 8"))
      << "the other file has one";
  EXPECT_EQ(sut.find("/src/same.st:3").value(), (PouLine{1, 3})) << "by its name alone";
  EXPECT_THAT(sut.find("c/same.st:3").error().message, HasSubstr("no POU or file"));
}

TEST_F(DeclaredPous, OfAWholePathAreFoundByItsLastParts) {
  ASSERT_EQ(declare("Fill", "/build/a/same.st", {2}), ERR_OK);
  ASSERT_EQ(declare("Cap", "/build/b/same.st", {2}), ERR_OK);
  EXPECT_EQ(sut.find("b/same.st:2").value(), (PouLine{1, 2}));
  EXPECT_EQ(sut.find("/moved/b/same.st:2").value(), (PouLine{1, 2}));
  EXPECT_EQ(sut.find("/build/a/same.st:2").value(), (PouLine{0, 2}));
}

TEST_F(DeclaredPous, AreRefused) {
  EXPECT_EQ(sut.declare(nullptr), ERR_PARAMETER);
  EXPECT_EQ(declare("", "a.st", {1}), ERR_PARAMETER);
  EXPECT_EQ(declare("a b", "a.st", {1}), ERR_PARAMETER);
  EXPECT_EQ(declare(std::string(64, 'a').c_str(), "a.st", {1}), ERR_PARAMETER);
  EXPECT_EQ(declare(nullptr, "a.st", {1}), ERR_PARAMETER);
  EXPECT_EQ(declare("A", "", {1}), ERR_PARAMETER);
  EXPECT_EQ(declare("A", nullptr, {1}), ERR_PARAMETER);
  EXPECT_EQ(declare("A", "a.st", {}), ERR_PARAMETER);
  EXPECT_EQ(declare("A", "a.st", {0, 1}), ERR_PARAMETER);
  EXPECT_EQ(declare("A", "a.st", {2, 2}), ERR_PARAMETER);
  EXPECT_EQ(declare("A", "a.st", {3, 2}), ERR_PARAMETER);
  EXPECT_TRUE(sut.pous().empty());
  EXPECT_EQ(declare("A", "a.st", {1}), ERR_OK);
  EXPECT_EQ(declare("a", "b.st", {1}), ERR_DUPLICATE);
  pous_.push_back(pous_.back());
  pous_.back().dwSize = 8;
  EXPECT_EQ(sut.declare(&pous_.back()), ERR_PARAMETER);
}

TEST_F(DeclaredPous, HaveLocalVariables) {
  ASSERT_EQ(declare("Pump", "a.st", {3, 5, 9, 11},
                    {{"x", PLC_TYPE_INT, 0, 0, 0},
                     {"x", PLC_TYPE_REAL, 4, 5, 5},
                     {"name", PLC_TYPE_COUNTED_STRING, 81, 9, 11},
                     {"at.y", PLC_TYPE_LINT, 0, 0, 0}}),
            ERR_OK);
  const DeclaredPou& pou = sut.pous().front();
  EXPECT_EQ(pou.local("X", 3).value(), whole(0));
  EXPECT_EQ(pou.local("x", 5).value(), whole(1)) << "that of the narrowest lines";
  EXPECT_EQ(pou.local("name", 9).value(), whole(2));
  EXPECT_EQ(pou.local("name", 8).value(), std::nullopt);
  EXPECT_EQ(pou.local("name", 12).value(), std::nullopt);
  EXPECT_EQ(pou.local("at.Y", 11).value(), whole(3));
  EXPECT_EQ(pou.local("z", 3).value(), std::nullopt);
  EXPECT_EQ(pou.locals[0].symbol.bytes, 2U);
  EXPECT_EQ(pou.locals[2].symbol.bytes, 81U);
}

// Two methods may even stand in one line.
TEST_F(DeclaredPous, HaveTheLocalVariablesOfACall) {
  ASSERT_EQ(
      declare("Pump", "a.st", {5},
              {{"x", PLC_TYPE_INT, 0, 5, 5}, {"y", PLC_TYPE_INT, 0, 5, 5}, {"x", PLC_TYPE_REAL, 0, 5, 5}}),
      ERR_OK);
  float x = 0;
  const std::array<void*, 1> addresses{&x};
  Plc_Frame frame{&pous_.back(), nullptr, 5, 0, nullptr, addresses.data(), 2, 1};
  const DeclaredPou& pou = sut.pous().front();
  EXPECT_EQ(pou.local("x", frame).value(), whole(2));
  EXPECT_EQ(pou.local("y", frame).value(), std::nullopt);
  frame.dwLine = 6;
  EXPECT_EQ(pou.local("x", frame).value(), std::nullopt);
  EXPECT_EQ(pou.local("x", 5).value(), whole(0));
}

TEST_F(DeclaredPous, HaveTheElementsOfLocalArrays) {
  ASSERT_EQ(declare("Sum", "a.st", {5},
                    {{"n", PLC_TYPE_INT, 0, 0, 0},
                     {"grid[][]", PLC_TYPE_DINT, 0, 0, 0},
                     {"points[].x", PLC_TYPE_INT, 0, 0, 0}},
                    {{1, 2, {{0, 2, 12}, {2, 3, 4}}}, {2, 1, {{-1, 3, 8}}}}),
            ERR_OK);
  const DeclaredPou& pou = sut.pous().front();
  EXPECT_EQ(pou.local("Grid[1, 3]", 5).value(), (LocalElement{.local = 1, .offset = 16}));
  EXPECT_EQ(pou.local("grid[0][2]", 5).value(), (LocalElement{.local = 1, .offset = 0}));
  EXPECT_EQ(pou.local("POINTS[1].X", 5).value(), (LocalElement{.local = 2, .offset = 16}));
  EXPECT_EQ(type_text(pou.locals[1].symbol), "ARRAY [0..1, 2..4] OF DINT");
  for (const char* const name : {"grid", "grid[1]", "grid[2,2]", "grid[1,1]", "grid[1,5]", "grid[]", "n[1]"})
    EXPECT_EQ(pou.local(name, 5).error().code, ErrorCode::invalid_argument) << name;
  EXPECT_THAT(pou.local("grid", 5).error().message, HasSubstr("name an element, as grid[0,2]"));
  EXPECT_THAT(pou.local("points[2].x", 5).error().message, HasSubstr("allowed as index 1 are -1 to 1"));
  EXPECT_EQ(pou.local("points[1].y", 5).value(), std::nullopt);
}

TEST_F(DeclaredPous, AreRefusedForTheirLocalArrays) {
  const auto with = [&](const char* name, const std::vector<Plc_LocalArray>& arrays) {
    return declare("A", "a.st", {1}, {{name, PLC_TYPE_INT, 0, 0, 0}}, arrays);
  };
  EXPECT_EQ(with("a[]", {}), ERR_PARAMETER);
  EXPECT_EQ(with("a", {{0, 1, {{0, 2, 2}}}}), ERR_PARAMETER);
  EXPECT_EQ(with("a[]", {{1, 1, {{0, 2, 2}}}}), ERR_PARAMETER);
  EXPECT_EQ(with("a[]", {{0, 1, {{0, 2, 2}}}, {0, 1, {{0, 2, 2}}}}), ERR_PARAMETER);
  EXPECT_EQ(with("a[]", {{0, 0, {}}}), ERR_PARAMETER);
  EXPECT_EQ(with("a[]", {{0, 4, {{0, 2, 2}}}}), ERR_PARAMETER);
  EXPECT_EQ(with("a[]", {{0, 1, {{0, 0, 2}}}}), ERR_PARAMETER);
  EXPECT_EQ(with("a[]", {{0, 1, {{0, 1U << 20U, 1U << 20U}}}}), ERR_PARAMETER);
  EXPECT_TRUE(sut.pous().empty());
  EXPECT_EQ(with("a[]", {{0, 1, {{0, 2, 2}}}}), ERR_OK);
}

// As plc_debug.h was.
TEST_F(DeclaredPous, OfABuildThatKnowsNoLocalArraysAreThere) {
  const std::array lines{5U};
  const std::array locals{Plc_Local{"n", PLC_TYPE_INT, 0, 0, 0}};
  Plc_Pou pou{56, "A", "a.st", lines.data(), 1, 0, locals.data(), 1, nullptr, 7};
  ASSERT_EQ(sut.declare(&pou), ERR_OK);
  EXPECT_EQ(sut.pous().front().locals.size(), 1U);
}

TEST_F(DeclaredPous, AreRefusedForTheirLocalVariables) {
  const auto with = [&](Plc_Local local) { return declare("A", "a.st", {1}, {local}); };
  EXPECT_EQ(with({nullptr, PLC_TYPE_INT, 0, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"", PLC_TYPE_INT, 0, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"a b", PLC_TYPE_INT, 0, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"a[]", PLC_TYPE_INT, 0, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({std::string(251, 'a').c_str(), PLC_TYPE_INT, 0, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"a", 0, 0, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"a", PLC_TYPE_SIZED_WSTRING + 1, 0, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"a", PLC_TYPE_INT, 4, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"a", PLC_TYPE_STRING, 0, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"a", PLC_TYPE_STRING, PLC_MAX_STRING + 1, 0, 0}), ERR_PARAMETER);
  EXPECT_EQ(with({"a", PLC_TYPE_INT, 0, 5, 4}), ERR_PARAMETER);
  EXPECT_EQ(with({"a", PLC_TYPE_INT, 0, 0, 4}), ERR_PARAMETER);
  Plc_Pou pou{sizeof(Plc_Pou), "A", "a.st", lines_.back().data(), 1, 0, nullptr, 1, nullptr, 0};
  EXPECT_EQ(sut.declare(&pou), ERR_PARAMETER);
  EXPECT_TRUE(sut.pous().empty());
}

TEST_F(DeclaredPous, HaveABoundOfLocalVariables) {
  std::vector<std::string> names;
  for (unsigned i = 0; i <= PLC_MAX_POU_LOCALS; ++i) names.push_back("v" + std::to_string(i));
  std::vector<Plc_Local> locals;
  for (const std::string& name : names) locals.push_back({name.c_str(), PLC_TYPE_INT, 0, 0, 0});
  EXPECT_EQ(declare("A", "a.st", {1}, locals), ERR_PARAMETER);
  locals.pop_back();
  EXPECT_EQ(declare("A", "a.st", {1}, locals), ERR_OK);
}

TEST_F(DeclaredPous, HaveABound) {
  std::vector<std::string> names;
  for (unsigned i = 0; i <= PLC_MAX_POUS; ++i) names.push_back("P" + std::to_string(i));
  for (unsigned i = 0; i < PLC_MAX_POUS; ++i) ASSERT_EQ(declare(names[i].c_str(), "a.st", {1}), ERR_OK);
  EXPECT_EQ(declare(names.back().c_str(), "a.st", {1}), ERR_NOMEMORY);
}

TEST_F(DeclaredPous, HaveInstances) {
  ASSERT_EQ(declare("Main", "a.st", {1}), ERR_OK);
  ASSERT_EQ(declare("Motor", "a.st", {5}), ERR_OK);
  std::array<int, 3> data{};
  EXPECT_EQ(sut.declare_instance(&pous_[1], data.data(), "Main.left"), ERR_OK);
  EXPECT_EQ(sut.declare_instance(&pous_[1], &data[1], "Main.right"), ERR_OK);
  EXPECT_EQ(sut.declare_instance(&pous_[1], &data[1], "Main.other"), ERR_DUPLICATE);
  EXPECT_EQ(sut.declare_instance(&pous_[1], nullptr, "Main.other"), ERR_PARAMETER);
  EXPECT_EQ(sut.declare_instance(&pous_[1], &data[2], ""), ERR_PARAMETER);
  EXPECT_EQ(sut.declare_instance(nullptr, &data[2], "x"), ERR_PARAMETER);
  EXPECT_EQ(sut.path_of(1, &data[1]), "Main.right");
  EXPECT_EQ(sut.path_of(0, &data[1]), "");
  EXPECT_TRUE(sut.instances_of(0).empty());
  ASSERT_FALSE(sut.instances_of(1).empty());
  EXPECT_EQ(sut.instances_of(1).front().path, "Main.left");
}

}  // namespace
}  // namespace plchost
