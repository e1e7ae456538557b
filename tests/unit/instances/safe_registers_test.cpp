// Outputs that are registers of a device: their safe state, and what they show when tasks drive them.
#include <array>
#include <atomic>
#include <cstdint>
#include <fstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "instances/runtime/memory/output_registers.hpp"
#include "tests/unit/instances/safe_outputs_under_test.hpp"

namespace plchost {
namespace {

// A task that begins restores what another one changes meanwhile.
TEST(OutputRegistersOfTwoTasks, EndWithTheLastChange) {
  std::array<std::byte, 1> registers{};
  const std::array<std::byte, 1> initial{};
  OutputRegisters sut(registers, {{.offset = 0, .bytes = 1}}, initial, {});
  const auto change = [&](std::byte value) {
    sut.note(0, value);
    OutputRegisters::publish();
    sut.write(0, std::span(&value, 1));
  };
  std::atomic<std::uint64_t> restored{0};
  std::atomic<bool> ends{false};
  std::thread first([&] {
    while (!ends) {
      sut.restore({.offset = 0, .bytes = 1});
      ++restored;
    }
  });
  unsigned wrong = 0;
  for (unsigned value = 1; value < 200'000; ++value) {
    const auto byte = static_cast<std::byte>(value);
    change(byte);
    const std::uint64_t since = restored;
    while (restored < since + 1) {
    }
    wrong += std::atomic_ref<std::byte>(registers[0]).load() == byte ? 0U : 1U;
  }
  ends = true;
  first.join();
  EXPECT_EQ(wrong, 0U);
}

TEST_F(SafeRegisters, AreWrittenAtTheStartAndAtAStopAndComeBackAsTheyWere) {
  place_registers("0x010000000200000003000000");
  EXPECT_EQ(in_file(), (Words{1, 2, 3}));
  run(0, 10);
  EXPECT_EQ(in_file(), (Words{1, 2, 3})) << "nobody has started the tasks";
  sut.outputs().arm();
  run(0, 11);
  EXPECT_EQ(in_file(), (Words{11, 2, 13}));
  sut.outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(in_file(), (Words{1, 2, 3}));
  sut.outputs().arm();
  changes = false;
  run(0, 12);
  EXPECT_EQ(in_file(), (Words{12, 2, 13})) << "a word that nobody changes is as it was";
}

TEST_F(SafeRegisters, ThatATaskJustWritesAreWrittenOverOnceMore) {
  place_registers("Zero");
  sut.outputs().arm();
  run(0, 10);
  sut.outputs().put_safe(PLC_IMAGE_STATE_EXCEPTION);
  EXPECT_EQ(in_file(), Words{});
  const auto write_late = [this] {
    std::fstream stream(file_, std::ios::binary | std::ios::in | std::ios::out);
    stream.seekp(8);
    stream.write("late", 4);
  };
  write_late();
  sut.outputs().beat([](std::size_t task) { return task == 0; });
  EXPECT_EQ(in_file(), Words{}) << "task One is in its cycle yet";
  write_late();
  sut.outputs().beat([](std::size_t) { return false; });
  EXPECT_EQ(in_file(), Words{});
  write_late();
  sut.outputs().beat([](std::size_t) { return false; });
  EXPECT_NE(in_file(), Words{}) << "nobody of this process can have written that";
}

TEST_F(SafeRegisters, ThatAreKeptAreLeftAlone) {
  place_registers("Keep");
  EXPECT_EQ(in_file()[0], 0x07070707U) << "as they were";
  sut.outputs().arm();
  run(0, 10);
  sut.outputs().fail();
  run(0, 11);
  EXPECT_EQ(in_file()[0], 10U);
}

// The process before has left 07; a task that changes nothing has put out its initial values.
TEST_F(SafeRegisters, ShowWhatTheTasksHaveAfterTheFirstCycleAlsoIfNobodyChangesIt) {
  for (const std::string safe : {"", "Keep", "Zero"}) {
    sut = Areas();
    tasks.clear();
    declared.clear();
    changes = false;
    place_registers(safe, 5);
    const std::uint32_t before = safe == "Zero" ? 0 : 0x07070707U;
    EXPECT_EQ(in_file(), (Words{before, before, before})) << safe;
    run(0, 10);
    EXPECT_EQ(in_file(), (Words{before, before, before})) << "nobody has started the tasks";
    sut.outputs().arm();
    EXPECT_EQ(in_file(), (Words{before, before, before})) << safe;
    run(0, 10);
    EXPECT_EQ(in_file(), (Words{10, before, 5})) << safe << ": task Two has not run";
    run(1, 20);
    EXPECT_EQ(in_file(), (Words{10, 21, 5})) << safe;
  }
}

TEST_F(SafeRegisters, ThatAreKeptShowAfterAStartWhatATaskHasChangedMeanwhile) {
  place_registers("Keep", 5);
  sut.outputs().arm();
  run(0, 10);
  sut.outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
  run(0, 20);
  EXPECT_EQ(in_file(), (Words{10, 0x07070707U, 12})) << "its last cycle was late";
  sut.outputs().arm();
  changes = false;
  run(0, 30);
  EXPECT_EQ(in_file(), (Words{30, 0x07070707U, 22}));
}

// As an operator does.
TEST_F(SafeRegisters, ShowAValueThatIsWrittenBetweenTwoCycles) {
  place_registers("", 5);
  changes = false;
  sut.outputs().arm();
  run(0, 10);
  words(one)[2] = 99;
  run(0, 11);
  EXPECT_EQ(in_file()[2], 99U);
}

TEST_F(SafeRegisters, OfATaskThatFailsAloneAreSafe) {
  place_registers("Zero");
  sut.outputs().arm();
  run(0, 10);
  run(1, 20);
  sut.outputs().task_fails(1);
  run(1, 30);
  EXPECT_EQ(in_file(), (Words{10, 0, 12}));
}

}  // namespace
}  // namespace plchost
