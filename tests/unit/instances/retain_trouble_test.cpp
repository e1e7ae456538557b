// The fate of retain variables whose memory was cut, or whose folder takes nothing.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/memory/retain_keeper.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/guard/memory_guard.hpp"
#include "tests/unit/instances/retain_fixture.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// The saved values when the memory or the folder is not as it should be.
class RetainInTrouble : public Retain {
 protected:
  RetainInTrouble() { MemoryGuard::watch_process(); }
  [[nodiscard]] std::string memory_path() const {
    return MemoryFile::path(pool_memory_name(name_.get(), retain_memory_name("line1")));
  }
  [[nodiscard]] LaunchOptions ours() const {
    LaunchOptions launch;
    launch.name = "line1";
    launch.pool = name_.get();
    launch.state_directory = folder_;
    return launch;
  }
  /// It has 42, and is in a file.
  void save_42() {
    start_well({.interval = std::chrono::milliseconds(10)});
    set(0, 42);
    set(1, 42);
    while (sut->saves() < 2) std::this_thread::yield();
  }
  void wait_for_unsaved() const {
    while (sut->unsaved() < 3) std::this_thread::yield();
  }
  void expect_42_from_the_file() {
    EXPECT_THAT(sut->problem(), HasSubstr("cut or overwritten"));
    wait_for_unsaved();
    EXPECT_EQ(sut->saves(), 2U);
    sut->finish();
    start_well();
    EXPECT_EQ(value(0), 42U);
    EXPECT_EQ(value(1), 42U);
    EXPECT_EQ(sut->origin(0), PLC_AREA_RESTORED);
    EXPECT_THAT(sut->remarks(), ElementsAre(HasSubstr("is not used")));
    EXPECT_EQ(sut->problem(), "");
  }
};

TEST_F(RetainInTrouble, MemoryThatWasCutToNothingIsNotSaved) {
  save_42();
  fs::resize_file(memory_path(), 0);
  wait_for_unsaved();
  expect_42_from_the_file();
}

TEST_F(RetainInTrouble, MemoryThatIsLostIsToldLongBeforeTheNextSave) {
  start_well({.interval = std::chrono::hours(1)});
  {
    const auto memory =
        MemoryFile::open(pool_memory_name(name_.get(), "line1.retain"), 1, MemoryFile::Access::read_write);
    std::ranges::fill(memory->bytes(), std::byte{0});
  }
  while (sut->problem().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_THAT(sut->problem(), HasSubstr("cut or overwritten"));
  EXPECT_EQ(sut->unsaved(), 0U) << "no save was due";
}

TEST_F(RetainInTrouble, MemoryThatWasCutAndMadeLongAgainIsNotSaved) {
  save_42();
  const auto size = fs::file_size(memory_path());
  // Its header stays.
  fs::resize_file(memory_path(), size - 24);
  fs::resize_file(memory_path(), size);
  wait_for_unsaved();
  expect_42_from_the_file();
}

TEST_F(RetainInTrouble, MemoryWithoutItsHeaderIsNotSaved) {
  save_42();
  {
    const auto memory =
        MemoryFile::open(pool_memory_name(name_.get(), "line1.retain"), 1, MemoryFile::Access::read_write);
    std::memset(memory->bytes().data(), 0, 8);
  }
  wait_for_unsaved();
  expect_42_from_the_file();
}

TEST_F(RetainInTrouble, MemoryThatLivesInAnotherOneThatWasCutIsNotSaved) {
  const std::string other = pool_memory_name(name_.get(), "registers");
  const auto registers = MemoryFile::create(other, 4096).value();
  ASSERT_TRUE(registers.guarded());
  const RetainKeeper::Options options{.directory = folder_, .interval = std::chrono::milliseconds(10)};
  sut = RetainKeeper::make(pool_, "line1", initial(), options).value();
  sut->memory().live_elsewhere(0, registers.bytes().first(8));
  ASSERT_TRUE(sut->start());
  const std::uint64_t number = 42;
  std::memcpy(registers.bytes().data(), &number, 8);
  while (sut->saves() < 2) std::this_thread::yield();
  fs::resize_file(MemoryFile::path(other), 0);
  wait_for_unsaved();
  EXPECT_THAT(sut->problem(), HasSubstr("cut or overwritten"));
  sut.reset();
  forget_memory();
  MemoryFile::remove(other);
  start_well();
  EXPECT_EQ(value(0), 42U);
}

TEST_F(RetainInTrouble, AFolderThatTakesNothingStopsNoMachineAndIsSavedToWhenItCan) {
  std::ofstream(folder_) << "no folder";
  start_well({.interval = std::chrono::milliseconds(10)});
  set(0, 42);
  wait_for_unsaved();
  EXPECT_THAT(sut->problem(), HasSubstr("line1.retain.lock"));
  EXPECT_EQ(sut->saves(), 0U);
  fs::remove(folder_);
  while (sut->saves() == 0) std::this_thread::yield();
  EXPECT_EQ(sut->problem(), "");
  sut.reset();
  forget_memory();
  start_well();
  EXPECT_EQ(value(0), 42U);
}

// A disk that is mounted late: the file on it was not loaded. So it is not overwritten, nor taken for newer
// than those that are written from then on.
TEST_F(RetainInTrouble, AFolderThatComesLateWithFilesKeepsThemAside) {
  save_42();
  set(0, 43);
  sut.reset();
  forget_memory();
  fs::rename(folder_, folder_.string() + ".away");
  std::ofstream(folder_) << "no folder";
  start_well({.interval = std::chrono::milliseconds(10)});
  EXPECT_EQ(value(0), kInitial);
  set(0, 7);
  wait_for_unsaved();
  const std::string away = folder_.string() + ".away";
  // At once, or the keeper makes the folder in between.
  ASSERT_EQ(::renameat2(AT_FDCWD, away.c_str(), AT_FDCWD, folder_.c_str(), RENAME_EXCHANGE), 0);
  fs::remove(away);
  while (sut->saves() == 0) std::this_thread::yield();
  EXPECT_TRUE(fs::exists(folder_ / "line1.retain.0.old"));
  sut.reset();
  forget_memory();
  start_well();
  EXPECT_EQ(value(0), 7U);
}

TEST_F(RetainInTrouble, AFileThatIsDamagedIsPutAsideBeforeAnotherTakesItsPlace) {
  save_42();
  sut.reset();
  forget_memory();
  std::ofstream(folder_ / "line1.retain.1") << "no values";
  start_well();
  EXPECT_EQ(value(0), 42U);
  EXPECT_THAT(sut->remarks(), testing::ElementsAre(HasSubstr("line1.retain.1: ")));
  EXPECT_EQ(fs::file_size(folder_ / "line1.retain.1.old"), 9U);
  EXPECT_FALSE(fs::exists(folder_ / "line1.retain.0.old")) << "it is whole";
}

TEST_F(RetainInTrouble, AFolderThatHasGoneWhileItRunsIsToldOnce) {
  start_well({.interval = std::chrono::milliseconds(10)});
  fs::rename(folder_, folder_.string() + ".away");
  set(0, 41);
  wait_for_unsaved();
  const std::string problem = sut->problem();
  EXPECT_THAT(problem, HasSubstr("line1.retain.0.new"));
  const auto until = sut->unsaved() + 3;
  while (sut->unsaved() < until) std::this_thread::yield();
  EXPECT_EQ(sut->problem(), problem) << "else each interval would log another one";
  set(0, 42);
  fs::rename(folder_.string() + ".away", folder_);
  while (sut->saves() < 2) std::this_thread::yield();
  EXPECT_EQ(sut->problem(), "");
}

TEST_F(RetainInTrouble, WhatAProcessHasLeftInMemoryOnlyIsSavedByAnother) {
  start_well({.interval = std::chrono::hours(1)});
  set(0, 42);
  lose_files_of_the_end();
  for (int twice = 0; twice < 2; ++twice) {
    const auto saved = save_left_behind(ours());
    ASSERT_TRUE(saved) << saved.error().describe();
  }
  EXPECT_FALSE(fs::exists(folder_ / "line1.retain.0.new"));
  forget_memory();
  ASSERT_TRUE(save_left_behind(ours())) << "there is nothing to be saved";
  start_well();
  EXPECT_EQ(value(0), 42U);
}

TEST_F(RetainInTrouble, WhatIsLeftInMemoryIsNotSavedOverANewerFileNorWhenItIsDamaged) {
  save_42();
  fs::copy(memory_path(), memory_path() + ".aside");
  set(0, 43);
  sut->save_soon();
  while (sut->saves() < 3) std::this_thread::yield();
  sut.reset();
  fs::rename(memory_path() + ".aside", memory_path());
  ASSERT_TRUE(save_left_behind(ours()));
  fs::resize_file(memory_path(), 0);
  ASSERT_TRUE(save_left_behind(ours()));
  forget_memory();
  start_well();
  EXPECT_EQ(value(0), 43U);
}

TEST_F(RetainInTrouble, WhatIsLeftInMemoryAndCannotBeSavedIsAnError) {
  start_well();
  sut.reset();
  LaunchOptions launch = ours();
  fs::remove_all(folder_);
  std::ofstream(folder_) << "no folder";
  EXPECT_FALSE(save_left_behind(launch));
  launch.state_directory.clear();
  EXPECT_FALSE(save_left_behind(launch));
  launch.settings = "/none.cfg";
  EXPECT_FALSE(save_left_behind(launch));
}

}  // namespace
}  // namespace plchost
