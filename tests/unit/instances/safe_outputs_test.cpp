// The safe state of outputs: its setting, what is shown when, and that tasks keep their values.
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "instances/runtime/memory/area_plan.hpp"
#include "instances/runtime/settings/read_settings.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/plc_process_image.h"
#include "tests/support/whole_cycle.hpp"
#include "tests/unit/instances/safe_outputs_under_test.hpp"

namespace plchost {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(SafeStateSetting, IsAWordInAnyCaseOrTheBytesInOrder) {
  EXPECT_EQ(parse_settings(area_with("Keep"), "l.cfg")->areas[0].safe, SafeState::keep);
  EXPECT_EQ(parse_settings(area_with("zERO"), "l.cfg")->areas[0].safe, SafeState::zero);
  EXPECT_EQ(parse_settings(area_with(""), "l.cfg")->areas[0].safe, SafeState::unsaid);
  const auto given = parse_settings(area_with("0x01fFa0", "3"), "l.cfg");
  ASSERT_TRUE(given) << given.error().describe();
  EXPECT_EQ(given->areas[0].safe, SafeState::values);
  EXPECT_EQ(given->areas[0].safe_values,
            (std::vector<std::byte>{std::byte{1}, std::byte{0xff}, std::byte{0xa0}}));
  const auto most = parse_settings(area_with("0x" + std::string(8192, '5'), "4096"), "l.cfg");
  ASSERT_TRUE(most) << most.error().describe();
  EXPECT_EQ(most->areas[0].safe_values.size(), 4096U);
}

TEST(SafeStateSetting, IsRefusedWithLineAndAllowedValues) {
  for (const std::string bad : {"Off", "0x", "0x123", "0x12g4", "12", "0x 12", "0x+1"}) {
    const auto refused = parse_settings(area_with(bad), "l.cfg");
    ASSERT_FALSE(refused) << bad;
    EXPECT_THAT(refused.error().message,
                AllOf(HasSubstr("l.cfg:5"), HasSubstr("Keep, Zero, or 0x and two hexadecimal digits")));
  }
  EXPECT_FALSE(parse_settings(area_with("0x" + std::string(8194, '5'), "4097"), "l.cfg"));
  EXPECT_THAT(
      parse_settings(area_with("0x1122"), "l.cfg").error().message,
      AllOf(HasSubstr("l.cfg:2: [SysMem] Area.0"),
            HasSubstr("SafeState gives 2 bytes, Size is 12; allowed are Keep, Zero, and all 12 bytes")));
  EXPECT_THAT(parse_settings("[SysMem]\nLinux.Area.0.Flags=4\nLinux.Area.0.Object=io\nLinux.Area.0.Size=1\n"
                             "Linux.Area.0.SafeState=Zero\n",
                             "l.cfg")
                  .error()
                  .message,
              HasSubstr("has a SafeState, which is for outputs; its Flags 0x4 need 0x8"));
}

TEST_F(SafeOutputsOfAreas, AreShownUntilTheFirstCycleAndOfATaskUntilItsOwn) {
  set_up("Zero");
  EXPECT_EQ(state(), PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(shown(), Words{});
  sut.outputs().arm();
  EXPECT_EQ(state(), PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(shown(), Words{}) << "no cycle has ended yet";
  run(0, 10);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_RUNNING);
  EXPECT_EQ(shown(), (Words{10, 0, 12}));
  run(1, 20);
  EXPECT_EQ(shown(), (Words{10, 21, 12}));
  sut.outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(shown(), Words{});
  sut.outputs().arm();
  // The third word is of neither: it comes back with the first cycle of either, as it was.
  run(1, 30);
  EXPECT_EQ(shown(), (Words{0, 31, 12}));
  run(0, 40);
  EXPECT_EQ(shown(), (Words{40, 31, 42}));
}

// A task that sets a byte of several tasks to its safe value has changed it.
TEST_F(SafeOutputsOfAreas, DoNotHideAChangeToTheSafeValue) {
  task("One", [this] { words(one)[2] = value; });
  task("Two", [this] { words(two)[2] += value; });
  const Words initials{5, 5, 5};
  declare("out", PLC_AREA_OUTPUT, 12, {{"One", 0, 4, &one}, {"Two", 4, 4, &two}}, nullptr, initials.data());
  ASSERT_TRUE(place_only(area_with("Zero")));
  ASSERT_TRUE(sut.keep());
  ASSERT_EQ(plc_image_open(pool_.c_str(), "io", 12, PLC_IMAGE_READ, &terminal.emplace()), 0);
  sut.outputs().arm();
  run(0, 0);
  EXPECT_EQ(shown()[2], 0U);
  run(1, 3);
  EXPECT_EQ(shown()[2], 3U);
  sut.outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(shown()[2], 0U);
  sut.outputs().arm();
  run(1, 4);
  EXPECT_EQ(shown()[2], 7U) << "it goes on from its own value";
}

// As an operator does. The image of the other task would take it back.
TEST_F(SafeOutputsOfAreas, ShowAValueThatIsWrittenBetweenTwoCycles) {
  set_up("Zero");
  sut.outputs().arm();
  run(0, 10);
  run(1, 20);
  EXPECT_EQ(shown(), (Words{10, 21, 12}));
  words(two)[2] = 99;
  run(1, 30);
  EXPECT_EQ(shown(), (Words{10, 31, 99}));
  words(two)[2] = 98;
  run(0, 40);
  run(1, 50);
  EXPECT_EQ(shown(), (Words{40, 51, 98})) << "its write comes after the change of the other task";
  run(1, 60);
  EXPECT_EQ(shown(), (Words{40, 61, 98}));
}

TEST_F(SafeOutputsOfAreas, OfAProcessThatWasForkedAreNotToldOf) {
  set_up("Zero");
  sut.outputs().arm();
  run(0, 10);
  const pid_t child = ::fork();
  if (child == 0) {
    sut.outputs().fail();
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_RUNNING);
  EXPECT_EQ(shown(), (Words{10, 0, 12}));
}

TEST_F(SafeOutputsOfAreas, AreLeftToTheManagerWhileATaskIsWithinACycle) {
  set_up("Zero");
  sut.outputs().arm();
  run(0, 10);
  sut.end_outputs(false);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_ENDED);
  EXPECT_TRUE(std::filesystem::exists(MemoryFile::path(outputs_page_name(pool_, "line1"))));
  sut.outputs().fail();
  EXPECT_EQ(state(), PLC_IMAGE_STATE_ENDED) << "nothing is told after the end";
}

TEST_F(SafeOutputsOfAreas, TellTheSilenceByTheState) {
  set_up("Zero");
  const auto beat_before = [this](plc_image_i64 ago) {
    terminal->header->heartbeat_ns = plc_image_now_ns() - ago;
  };
  constexpr plc_image_i64 kLong = 1'000'000'000'000;
  beat_before(PLC_IMAGE_PATIENCE_NS / 2);
  EXPECT_EQ(plc_image_silence_ns(&*terminal), 0) << "stopped";
  beat_before(PLC_IMAGE_PATIENCE_NS + kLong);
  EXPECT_GE(plc_image_silence_ns(&*terminal), kLong);
  terminal->header->heartbeat_ns = 0;
  EXPECT_EQ(plc_image_silence_ns(&*terminal), PLC_IMAGE_NEVER);
  sut.outputs().arm();
  run(0, 1);
  EXPECT_LT(plc_image_silence_ns(&*terminal), kLong) << "it runs: the image counts";
  terminal->header->latest = 0;
  EXPECT_EQ(plc_image_silence_ns(&*terminal), PLC_IMAGE_NEVER);
  sut.end_outputs(true);
  EXPECT_EQ(plc_image_silence_ns(&*terminal), 0) << "ended";
}

// Settings that name no safe state leave it to the terminals, each of which has a limit of its own.
TEST_F(SafeOutputsOfAreas, AreToldByTheirAgeIfTheSettingsNameNone) {
  set_up("");
  sut.outputs().arm();
  run(0, 10);
  for (const unsigned state :
       {PLC_IMAGE_STATE_STOPPED, PLC_IMAGE_STATE_EXCEPTION, PLC_IMAGE_STATE_HALTED, PLC_IMAGE_STATE_ENDED}) {
    sut.outputs().put_safe(state);
    sut.outputs().beat([](std::size_t) { return false; });
    EXPECT_EQ(shown(), (Words{10, 5, 12})) << "as if they were kept";
    const plc_image_i64 age_ns = plc_image_age_ns(&*terminal);
    EXPECT_GT(age_ns, 0);
    EXPECT_GE(plc_image_silence_ns(&*terminal), age_ns) << state;
  }
}

// A terminal that has cleared its outputs would switch them on again, though no task has run.
TEST_F(SafeOutputsOfAreas, AreNoFresherByTheNextProcessIfTheSettingsNameNone) {
  set_up("");
  EXPECT_EQ(plc_image_silence_ns(&*terminal), PLC_IMAGE_NEVER) << "no task has put anything out yet";
  sut.outputs().arm();
  run(0, 10);
  sut.outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
  Words read{};
  plc_image_i64 before_ns = 0;
  ASSERT_EQ(plc_image_read_latest(&*terminal, read.data(), &before_ns), PLC_IMAGE_OK);
  OutputImage next(std::span(reinterpret_cast<std::byte*>(terminal->header), terminal->mapped), 12);
  const Words initial{7, 7, 7};
  next.begin(std::as_bytes(std::span(initial)), {}, false);
  EXPECT_EQ(shown(), (Words{10, 5, 12}));
  plc_image_i64 stamp_ns = 0;
  ASSERT_EQ(plc_image_read_latest(&*terminal, read.data(), &stamp_ns), PLC_IMAGE_OK);
  EXPECT_EQ(read, initial);
  EXPECT_EQ(stamp_ns, before_ns) << "the age goes on";
  next.arm();
  next.write(std::as_bytes(std::span(initial)));
  next.published();
  EXPECT_EQ(shown(), initial);
  EXPECT_LT(plc_image_silence_ns(&*terminal), PLC_IMAGE_NEVER);
}

// A terminal would go on with the last image that it could read.
TEST_F(SafeOutputsOfAreas, ThatAStrangerHasSpoiledAreSilence) {
  set_up("Zero");
  sut.outputs().beat([](std::size_t) { return false; });
  ASSERT_EQ(plc_image_silence_ns(&*terminal), 0);
  const std::uint64_t safe = terminal->header->safe;
  for (const std::uint64_t spoiled : {std::uint64_t{0}, std::uint64_t{0x1ff}, safe + 0x100}) {
    for (const bool ended : {false, true}) {
      if (ended) plc_image_tell(&*terminal, PLC_IMAGE_STATE_ENDED, 1);
      terminal->header->safe = spoiled;
      EXPECT_EQ(plc_image_silence_ns(&*terminal), PLC_IMAGE_NEVER) << spoiled;
      terminal->header->safe = safe;
      EXPECT_EQ(plc_image_silence_ns(&*terminal), 0);
    }
  }
}

// Firmware that writes inputs tells nothing of itself, and shows what it writes.
TEST_F(SafeOutputsOfAreas, AreNoneOfTheNextWriterThatTellsNoState) {
  set_up("Zero");
  sut.end_outputs(true);
  const std::string copy = MemoryFile::path(pool_memory_name(pool_, "copy"));
  std::filesystem::copy_file(MemoryFile::path(pool_memory_name(pool_, "io")), copy);
  plc_image writer{};
  ASSERT_EQ(plc_image_open(pool_.c_str(), "copy", 12, PLC_IMAGE_WRITE, &writer), 0);
  const Words written{7, 8, 9};
  plc_image_write(&writer, written.data());
  Words read{};
  EXPECT_EQ(plc_image_read(&writer, read.data(), nullptr), PLC_IMAGE_OK);
  EXPECT_EQ(read, written);
  EXPECT_EQ(plc_image_state(&writer), PLC_IMAGE_STATE_UNTOLD);
  plc_image_close(&writer);
}

TEST_F(SafeOutputsOfAreas, AreNotLeftByATaskThatComesBackAfterAFault) {
  set_up("Zero");
  sut.outputs().arm();
  run(0, 10);
  sut.outputs().fail();
  EXPECT_EQ(state(), PLC_IMAGE_STATE_EXCEPTION);
  EXPECT_EQ(shown(), Words{}) << "without the control thread";
  run(0, 11);
  EXPECT_EQ(shown(), Words{});
  sut.outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_EXCEPTION) << "until a fresh process";
  run(1, 12);
  EXPECT_EQ(shown(), Words{});
  sut.end_outputs(true);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_ENDED);
  EXPECT_EQ(shown(), Words{});
}

TEST_F(SafeOutputsOfAreas, ThatAreKeptDoNotChangeWhenATaskComesBack) {
  set_up("Keep");
  EXPECT_EQ(shown(), (Words{5, 5, 5})) << "initial values: the image is new";
  sut.outputs().arm();
  run(0, 10);
  sut.outputs().fail();
  sut.outputs().put_safe(PLC_IMAGE_STATE_EXCEPTION);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_EXCEPTION);
  EXPECT_EQ(shown(), (Words{10, 5, 12}));
  run(0, 11);
  EXPECT_EQ(shown(), (Words{10, 5, 12}));
}

TEST_F(SafeOutputsOfAreas, BeginWithAFaultBeforeTheFirstCycleHasEnded) {
  set_up("Zero");
  sut.outputs().arm();
  sut.outputs().fail();
  run(0, 10);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_EXCEPTION);
  EXPECT_EQ(shown(), Words{});
}

TEST_F(SafeOutputsOfAreas, AreThoseBytesThatATaskAloneWritesIfItFailsAlone) {
  set_up("0x010000000200000003000000");
  sut.outputs().arm();
  run(0, 10);
  run(1, 20);
  sut.outputs().task_fails(1);
  EXPECT_EQ(shown(), (Words{10, 2, 12}));
  EXPECT_EQ(state(), PLC_IMAGE_STATE_RUNNING);
  run(1, 30);
  EXPECT_EQ(shown(), (Words{10, 2, 12})) << "it publishes no more";
  run(0, 40);
  EXPECT_EQ(shown(), (Words{40, 2, 42}));
}

TEST_F(SafeOutputsOfAreas, AreInExceptionWhenAllWhoWriteThemHaveFailedAlone) {
  set_up("0x010000000200000003000000");
  sut.outputs().arm();
  run(0, 10);
  run(1, 20);
  sut.outputs().task_fails(1);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_RUNNING);
  sut.outputs().task_fails(0);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_EXCEPTION);
  EXPECT_EQ(shown(), (Words{1, 2, 3})) << "also the word that both of them change";
  sut.outputs().put_safe(PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_EXCEPTION) << "no start helps";
  sut.end_outputs(true);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_ENDED);
}

TEST_F(SafeOutputsOfAreas, AreReachedWhenAllWhoWriteThemRest) {
  set_up("Zero");
  sut.outputs().arm();
  run(0, 10);
  sut.outputs().task_rests(0);
  EXPECT_EQ(shown(), (Words{10, 0, 12}));
  sut.outputs().task_rests(1);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(shown(), Words{});
}

TEST_F(SafeOutputsOfAreas, OfAProcessThatLeftItsImageHalfWrittenAreTakenOver) {
  set_up("Keep");
  sut.outputs().arm();
  run(0, 10);
  // As a process leaves it that is killed while it makes its safe image.
  const unsigned spare =
      (terminal->header->safe & 0xffU) == PLC_IMAGE_SLOTS ? PLC_IMAGE_SLOTS + 1U : PLC_IMAGE_SLOTS;
  plc_image_slot_at(&*terminal, spare)->sequence = 0;
  ASSERT_EQ(shown(), (Words{10, 5, 12}));
  OutputImage next(std::span(reinterpret_cast<std::byte*>(terminal->header), terminal->mapped), 12);
  const Words initial{7, 7, 7};
  next.begin(std::as_bytes(std::span(initial)), {}, true);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(shown(), (Words{10, 5, 12})) << "kept until its first cycle";
  next.arm();
  next.write(std::as_bytes(std::span(initial)));
  next.published();
  EXPECT_EQ(shown(), initial);
  EXPECT_EQ(state(), PLC_IMAGE_STATE_RUNNING);
}

TEST_F(SafeOutputsOfAreas, AreRefusedInAnObjectOfOtherAreas) {
  task("Main", [] {});
  declare("data", PLC_AREA_MEMORY, 8);
  const auto placed = place(
      "[SysMem]\nLinux.Area.0.Flags=0x18\nLinux.Area.0.Object=io\nLinux.Area.0.Size=8\n"
      "Linux.Area.0.SafeState=Zero\n");
  ASSERT_FALSE(placed);
  EXPECT_THAT(placed.error().message, AllOf(HasSubstr("l.cfg:2: [SysMem] Area.0"), HasSubstr("area 'data'"),
                                            HasSubstr("is no output")));
}

TEST_F(SafeOutputsOfAreas, AreRefusedInAnImageOfTheHeaderBefore) {
  task("Main", [] {});
  declare("out", PLC_AREA_OUTPUT, 12);
  const std::size_t before = plc_image_bytes(12) - PLC_IMAGE_SAFE_SLOTS * plc_image_stride(12);
  ASSERT_TRUE(shared_.create_memory("io", before, {.keep = true}, {}));
  const auto placed = place(area_with("Zero"));
  ASSERT_FALSE(placed);
  EXPECT_THAT(placed.error().message,
              AllOf(HasSubstr("l.cfg:2: [SysMem] Area.0"), HasSubstr("plc_process_image.h before version 2"),
                    HasSubstr("remove it")));
}

TEST_F(SafeOutputsOfAreas, TellTheAgesOfTheLastImageAndOfTheProcess) {
  set_up("Zero");
  EXPECT_LT(plc_image_age_ns(&*terminal), PLC_IMAGE_NEVER);
  terminal->header->heartbeat_ns = 1;
  EXPECT_GT(plc_image_heartbeat_age_ns(&*terminal), 1'000'000);
  const plc_image_i64 before = plc_image_now_ns();
  sut.outputs().beat([](std::size_t) { return false; });
  EXPECT_GE(terminal->header->heartbeat_ns, before);
  // A stranger's: none of them is young.
  terminal->header->heartbeat_ns = plc_image_now_ns() + 1'000'000'000'000;
  EXPECT_EQ(plc_image_heartbeat_age_ns(&*terminal), PLC_IMAGE_NEVER);
  for (const std::uint64_t latest : {std::uint64_t{0}, std::uint64_t{0x1ff}, std::uint64_t{0x1103}}) {
    terminal->header->latest = latest;
    EXPECT_EQ(plc_image_age_ns(&*terminal), PLC_IMAGE_NEVER);
  }
}

}  // namespace
}  // namespace plchost
