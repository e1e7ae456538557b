// The outputs of tasks that a debugger halts, as a terminal sees them until the tasks go on.
#include <cstddef>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/unit/instances/safe_outputs_under_test.hpp"

namespace plchost {
namespace {

using HaltedOutputsOfAreas = SafeOutputsOfAreas;
using HaltedRegisters = SafeRegisters;

TEST_F(HaltedOutputsOfAreas, AreSafeUntilTheCycleHasEndedThatWasHalted) {
  set_up("0x010000000200000003000000");
  sut.outputs().arm();
  run(0, 10);
  run(1, 20);
  EXPECT_EQ(shown(), (Words{10, 21, 12}));
  halt({0});
  EXPECT_EQ(state(), PLC_IMAGE_STATE_HALTED);
  EXPECT_EQ(shown(), (Words{1, 2, 3}));
  run(1, 30);
  EXPECT_EQ(shown(), (Words{1, 2, 3})) << "task Two goes on, and is seen by no terminal";
  halt({0});
  EXPECT_EQ(shown(), (Words{1, 2, 3}));
  halt({});
  EXPECT_EQ(shown(), (Words{1, 2, 3})) << "no cycle has ended yet";
  run(1, 40);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_RUNNING);
  EXPECT_EQ(shown(), (Words{1, 41, 12})) << "the word of task One is safe until its own cycle ends";
  run(0, 50);
  EXPECT_EQ(shown(), (Words{50, 41, 52}));
}

TEST_F(HaltedOutputsOfAreas, AreSafeAsLongAsOneOfTheirTasksHalts) {
  set_up("Zero");
  sut.outputs().arm();
  run(0, 10);
  halt({0});
  halt({0, 1});
  halt({1});
  run(0, 20);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_HALTED);
  EXPECT_EQ(shown(), Words{});
  halt({});
  run(1, 30);
  EXPECT_EQ(shown(), (Words{20, 31, 22}));
}

TEST_F(HaltedOutputsOfAreas, ThatAreKeptShowTheLastValues) {
  set_up("Keep");
  sut.outputs().arm();
  run(0, 10);
  run(1, 10);
  halt({0});
  EXPECT_EQ(state(), PLC_IMAGE_STATE_HALTED);
  EXPECT_EQ(shown(), (Words{10, 11, 12}));
  run(1, 20);
  EXPECT_EQ(shown(), (Words{10, 11, 12}));
  halt({});
  run(0, 30);
  EXPECT_EQ(shown(), (Words{30, 21, 32}));
}

TEST_F(HaltedOutputsOfAreas, CanHaltInTheFirstCycle) {
  set_up("0x010000000200000003000000");
  sut.outputs().arm();
  halt({0});
  EXPECT_EQ(state(), PLC_IMAGE_STATE_HALTED);
  halt({});
  run(0, 10);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_RUNNING);
  EXPECT_EQ(shown(), (Words{10, 2, 12}));
}

TEST_F(HaltedOutputsOfAreas, DoNotComeBackAfterAFaultOrAStop) {
  set_up("Zero");
  sut.outputs().arm();
  run(0, 10);
  halt({0});
  sut.outputs().fail();
  EXPECT_EQ(state(), PLC_IMAGE_STATE_EXCEPTION);
  halt({});
  run(0, 20);
  run(1, 20);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_EXCEPTION);
  EXPECT_EQ(shown(), Words{});
}

TEST_F(HaltedOutputsOfAreas, AreStoppedByAStop) {
  set_up("Zero");
  halt({0});
  EXPECT_EQ(state(), PLC_IMAGE_STATE_STOPPED) << "before the start";
  sut.outputs().arm();
  run(0, 10);
  halt({0});
  sut.outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
  halt({});
  run(0, 20);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(shown(), Words{});
  sut.outputs().arm();
  halt({});
  run(0, 30);
  run(1, 30);
  EXPECT_EQ(shown(), (Words{30, 31, 32}));
}

TEST_F(HaltedRegisters, AreSafeAndComeBackWithEachTask) {
  place_registers("0x010000000200000003000000");
  sut.outputs().arm();
  run(0, 10);
  run(1, 10);
  EXPECT_EQ(in_file(), (Words{10, 11, 12}));
  halt({0});
  EXPECT_EQ(in_file(), (Words{1, 2, 3}));
  run(1, 20);
  EXPECT_EQ(in_file(), (Words{1, 2, 3}));
  sut.outputs().beat([](std::size_t) { return false; });
  EXPECT_EQ(in_file(), (Words{1, 2, 3}));
  halt({});
  EXPECT_EQ(in_file(), (Words{1, 2, 3}));
  changes = false;
  run(1, 30);
  EXPECT_EQ(in_file(), (Words{1, 31, 12})) << "the last word is of no task: it is as it was changed last";
  run(0, 40);
  EXPECT_EQ(in_file(), (Words{40, 31, 12}));
}

TEST_F(HaltedRegisters, ComeBackWithWhatOtherTasksHaveChangedMeanwhile) {
  place_registers("Zero");
  sut.outputs().arm();
  run(0, 10);
  run(1, 10);
  halt({1});
  run(0, 20);
  EXPECT_EQ(in_file(), Words{});
  halt({});
  changes = false;
  run(1, 30);
  EXPECT_EQ(in_file(), (Words{0, 31, 22}));
}

TEST_F(HaltedRegisters, OfATaskThatWritesThemJustWhenAnotherOneHaltsAreWrittenOver) {
  place_registers("Zero");
  sut.outputs().arm();
  run(0, 10);
  halt({0});
  std::fstream stream(file_, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekp(12);
  stream.write("late", 4);
  stream.close();
  sut.outputs().beat([](std::size_t task) { return task == 1; });
  EXPECT_EQ(in_file(), Words{});
}

TEST_F(HaltedRegisters, ThatAreKeptAreNoMatterOfOtherTasks) {
  place_registers("Keep");
  sut.outputs().arm();
  run(0, 10);
  halt({0});
  run(1, 20);
  EXPECT_EQ(in_file(), (Words{10, 21, 12}));
}

TEST_F(HaltedRegisters, StaySafeAfterAFault) {
  place_registers("Zero");
  sut.outputs().arm();
  run(0, 10);
  halt({0});
  sut.outputs().fail();
  halt({});
  run(0, 20);
  EXPECT_EQ(in_file(), Words{});
}

}  // namespace
}  // namespace plchost
