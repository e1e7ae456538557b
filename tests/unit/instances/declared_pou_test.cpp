#include "instances/runtime/debug/declared_pou.hpp"

#include <array>
#include <deque>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

using testing::HasSubstr;

class DeclaredPous : public testing::Test {
 protected:
  RTS_RESULT declare(const char* name, const char* file, std::vector<unsigned> lines) {
    lines_.push_back(std::move(lines));
    pous_.push_back(
        {sizeof(Plc_Pou), name, file, lines_.back().data(), static_cast<unsigned>(lines_.back().size()), 0});
    return sut.declare(&pous_.back());
  }

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
