// Where retain and persistent variables come from at a start, and when they are written.
#include "instances/runtime/memory/retain_keeper.hpp"

#include <array>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/plc_app.h"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/unit/instances/retain_fixture.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(Retain, BeginsWithInitialValues) {
  start_well();
  EXPECT_EQ(value(0), kInitial);
  EXPECT_EQ(sut->origin(0), PLC_AREA_INITIAL);
  EXPECT_THAT(sut->remarks(), IsEmpty());
  EXPECT_EQ(sut->saves(), 1U) << "also what begins so is written at once";
}

TEST_F(Retain, LosesNothingWithItsProcess) {
  start_well({.interval = std::chrono::hours(1)});
  set(0, 42);
  lose_files_of_the_end();
  start_well();
  EXPECT_EQ(value(0), 42U);
  EXPECT_EQ(sut->origin(0), PLC_AREA_RETAINED);
}

TEST_F(Retain, TheirMemoryIsAKeptObjectOfThePool) {
  start_well();
  const auto object = pool_.look_at("line1.retain");
  ASSERT_TRUE(object) << object.error().describe();
  EXPECT_TRUE(object->kept);
  EXPECT_GT(object->size, sut->memory().data().size());
  EXPECT_EQ(object->reference_count, 1U);
  EXPECT_EQ(pool_.create_memory("line1.retain", 10).error().code, ErrorCode::wrong_size)
      << "nobody else gets another one under its name";
  sut.reset();
  EXPECT_EQ(pool_.look_at("line1.retain")->reference_count, 0U);
}

TEST_F(Retain, GoOnWhenThePoolWasMadeAnewAroundTheirFile) {
  start_well({.interval = std::chrono::hours(1)});
  set(0, 42);
  lose_files_of_the_end();
  MemoryFile::remove(name_.get());
  pool_ = ObjectPool::create(name_.get(), {.max_objects = 16}).value();
  start_well();
  EXPECT_EQ(value(0), 42U);
  EXPECT_EQ(sut->origin(0), PLC_AREA_RETAINED);
  EXPECT_TRUE(pool_.look_at("line1.retain"));
}

TEST_F(Retain, HasWhatWasWrittenLastAfterAPowerCut) {
  start_well({.interval = std::chrono::milliseconds(10)});
  set(0, 42);
  while (sut->saves() < 2) std::this_thread::yield();
  lose_files_of_the_end();
  forget_memory();
  start_well();
  EXPECT_EQ(value(0), 42U);
  EXPECT_EQ(value(1), kInitial);
  EXPECT_EQ(sut->origin(0), PLC_AREA_RESTORED);
}

TEST_F(Retain, IsWrittenAtTheEndAndWhenItIsAskedFor) {
  start_well({.interval = std::chrono::hours(1)});
  set(1, 2);
  sut->save_soon();
  while (sut->saves() < 2) std::this_thread::yield();
  set(1, 3);
  sut.reset();
  forget_memory();
  start_well();
  EXPECT_EQ(value(1), 3U);
}

TEST_F(Retain, ThatDoesNotChangeIsNotWrittenAgain) {
  start_well({.interval = std::chrono::milliseconds(10)});
  const auto before = fs::last_write_time(folder_ / "line1.retain.1");
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(sut->saves(), 1U);
  EXPECT_EQ(fs::last_write_time(folder_ / "line1.retain.1"), before);
}

TEST_F(Retain, ColdResetInitialisesRetainAndKeepsPersistent) {
  start_well();
  set(0, 42);
  set(1, 43);
  start_well({.cold = true});
  EXPECT_EQ(value(0), kInitial);
  EXPECT_EQ(value(1), 43U);
  EXPECT_EQ(sut->origin(0), PLC_AREA_INITIAL);
  EXPECT_EQ(sut->origin(1), PLC_AREA_RETAINED);
  lose_files_of_the_end();
  forget_memory();
  start_well();
  EXPECT_EQ(value(0), kInitial) << "the reset holds over a power cut right behind it";
  EXPECT_EQ(value(1), 43U);
}

TEST_F(Retain, OfAnotherLayoutIsInitialisedAndPutAside) {
  start_well();
  set(0, 42);
  ASSERT_TRUE(start(initial(1)));
  EXPECT_EQ(value(0), kInitial);
  EXPECT_THAT(sut->remarks(), ElementsAre(HasSubstr("area 'count' has another layout")));
  EXPECT_TRUE(fs::exists(folder_ / "line1.retain.1.old"));
}

// The application that was loaded does not come up, and the one before starts again.
TEST_F(Retain, OfAStartThatFailsLeaveThoseOfBeforeAsTheyWere) {
  for (const bool power_cut : {false, true}) {
    start_well();
    set(0, 42);
    sut.reset();
    if (power_cut) forget_memory();
    for (const bool cold : {false, true}) {
      sut = RetainKeeper::make(pool_, "line1", initial(7), {.directory = folder_, .cold = cold}).value();
      EXPECT_EQ(value(0), kInitial);
      set(0, 13);
      sut.reset();
    }
    sut = RetainKeeper::make(pool_, "line1", initial(), {.directory = folder_, .cold = true}).value();
    EXPECT_EQ(value(0), kInitial);
    sut.reset();
    EXPECT_FALSE(std::filesystem::exists(folder_ / "line1.retain.0.old"));
    start_well();
    EXPECT_EQ(value(0), 42U);
    EXPECT_EQ(sut->origin(0), power_cut ? PLC_AREA_RESTORED : PLC_AREA_RETAINED);
  }
}

TEST_F(Retain, OfAnotherLayoutIsRefusedIfWanted) {
  start_well();
  set(0, 42);
  const auto refused = start(initial(1), {.mismatch = RetainMismatch::refuse});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::refused);
  EXPECT_THAT(refused.error().message, HasSubstr("area 'count' has another layout"));
  start_well();
  EXPECT_EQ(value(0), 42U) << "and is still there for the right application";
}

TEST_F(Retain, OfAnotherLayoutIsTakenByNameIfWanted) {
  start_well();
  set(0, 42);
  set(1, 0x0102030405060708);
  RetainImage other = initial(1);
  other.layout.areas = {
      {.name = "new", .flags = PLC_AREA_RETAIN, .bytes = 4, .layout = 0, .offset = 0},
      {.name = "hours", .flags = PLC_AREA_PERSISTENT, .bytes = 4, .layout = 0, .offset = 8}};
  ASSERT_TRUE(start(other, {.mismatch = RetainMismatch::ignore}));
  EXPECT_EQ(value(0), kInitial);
  EXPECT_EQ(value(1) & 0xffffffff, 0x05060708U);
  EXPECT_EQ(sut->origin(0), PLC_AREA_INITIAL);
  EXPECT_EQ(sut->origin(1), PLC_AREA_RETAINED);
}

TEST_F(Retain, OfAnotherApplicationIsOfAnotherLayout) {
  start_well();
  RetainImage other = initial();
  other.layout.application = "Press";
  const auto refused = start(other, {.mismatch = RetainMismatch::refuse});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("application 'Mixer'"));
}

TEST_F(Retain, TakesAFileThatIsNewerThanTheMemory) {
  start_well();
  set(0, 42);
  sut.reset();
  // The same instance ran in another pool meanwhile.
  const UniquePoolName other;
  ObjectPool here = std::exchange(pool_, ObjectPool::create(other.get(), {.max_objects = 16}).value());
  start_well();
  EXPECT_EQ(value(0), 42U);
  set(0, 43);
  sut.reset();
  pool_ = std::move(here);
  start_well();
  EXPECT_EQ(value(0), 43U);
  EXPECT_EQ(sut->origin(0), PLC_AREA_RESTORED);
}

TEST_F(Retain, IsNeverTakenFromTheMiddleOfACycle) {
  start_well({.interval = std::chrono::hours(1)});
  CycleCounter& counter = sut->memory().counter(3);
  counter = 1;
  set(0, 13);
  sut->finish();
  EXPECT_EQ(sut->unsaved(), 1U);
  EXPECT_EQ(sut->saves(), 1U);
  sut.reset();
  forget_memory();
  start_well();
  EXPECT_EQ(value(0), kInitial) << "the last written values";
}

TEST_F(Retain, OfOneFileIsOfTheEndOfOneCycle) {
  start_well({.interval = std::chrono::milliseconds(10)});
  std::atomic<bool> stop{false};
  std::thread task([&] {
    CycleCounter& counter = sut->memory().counter(0);
    for (std::uint64_t cycle = 2; !stop; ++cycle) {
      counter.store(counter.load() + 1, std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_release);
      set(0, cycle);
      std::this_thread::sleep_for(std::chrono::microseconds(50));
      set(1, cycle);
      counter.store(counter.load() + 1, std::memory_order_release);
      std::this_thread::sleep_for(std::chrono::microseconds(150));
    }
  });
  for (std::uint64_t seen = 0; seen < 20;) {
    const auto files = fs::path(folder_);
    for (const char* name : {"line1.retain.0", "line1.retain.1"}) {
      std::ifstream stream(files / name, std::ios::binary);
      const std::string text{std::istreambuf_iterator<char>(stream), {}};
      const auto image = decode_retain(text);
      if (!image) continue;  // not there yet
      std::uint64_t count = 0;
      std::uint64_t hours = 0;
      std::memcpy(&count, image->data.data(), 8);
      std::memcpy(&hours, image->data.data() + 8, 8);
      ASSERT_EQ(count, hours) << "generation " << image->generation;
    }
    seen = sut->saves();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  stop = true;
  task.join();
}

/// A task whose cycles follow each other without a pause, until the end of its life. Each writes its number
/// to the areas, one at its beginning, the other at its end.
class BusyTask {
 public:
  BusyTask(RetainKeeper& keeper, std::size_t task, RetainGroup& group, std::vector<std::uint64_t*> areas,
           bool may_wait = false)
      : thread_([this, &group, areas, may_wait, &counter = keeper.memory().counter(task)] {
          for (std::uint64_t cycle = 2; !stop_; ++cycle) {
            counter.store(counter.load() + 1, std::memory_order_relaxed);
            std::atomic_thread_fence(std::memory_order_release);
            for (std::uint64_t* const area : areas) {
              std::this_thread::sleep_for(std::chrono::milliseconds(1));
              std::atomic_ref(*area).store(cycle, std::memory_order_relaxed);
            }
            counter.store(counter.load() + 1, std::memory_order_release);
            group.answer(may_wait);
          }
        }) {}
  ~BusyTask() {
    stop_ = true;
    thread_.join();
  }
  BusyTask(const BusyTask&) = delete;
  BusyTask& operator=(const BusyTask&) = delete;

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class RetainOfBusyTasks : public Retain {
 protected:
  RetainOfBusyTasks() {
    sut = RetainKeeper::make(pool_, "line1", initial(),
                             {.directory = folder_,
                              .interval = std::chrono::milliseconds(10),
                              .postpone = std::chrono::milliseconds(2)})
              .value();
  }
  RetainGroup& group(const std::vector<std::size_t>& tasks,
                     const std::vector<std::pair<std::size_t, std::size_t>>& stretches) {
    sut->memory().add_group(tasks, stretches);
    return sut->memory().groups().back();
  }
  std::uint64_t* area(std::size_t number) {
    return reinterpret_cast<std::uint64_t*>(sut->memory().data().data()) + number;
  }
  /// The numbers in the newer of the two files.
  [[nodiscard]] std::array<std::uint64_t, 2> saved() const {
    std::array<std::uint64_t, 2> numbers{};
    std::uint64_t newest = 0;
    for (const char* name : {"line1.retain.0", "line1.retain.1"}) {
      std::ifstream stream(folder_ / name, std::ios::binary);
      const std::string text{std::istreambuf_iterator<char>(stream), {}};
      const auto image = decode_retain(text);
      if (!image || image->generation < newest) continue;
      newest = image->generation;
      std::memcpy(numbers.data(), image->data.data(), sizeof(numbers));
    }
    return numbers;
  }
};

TEST_F(RetainOfBusyTasks, IsSavedAtTheEndOfACycleIfOneFollowsTheOtherWithoutAPause) {
  RetainGroup& both = group({0}, {{0, 8}, {8, 8}});
  ASSERT_TRUE(sut->start());
  const BusyTask task(*sut, 0, both, {area(0), area(1)});
  for (std::uint64_t seen = 1; seen < 12;) {
    const auto [count, hours] = saved();
    ASSERT_EQ(count, hours);
    seen = sut->saves();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(sut->unsaved(), 0U);
  EXPECT_GT(saved()[0], kInitial);
}

TEST_F(RetainOfBusyTasks, IsSavedWhenTwoOfThemShareAnAreaAndOneMayWait) {
  RetainGroup& both = group({0, 1}, {{0, 8}, {8, 8}});
  ASSERT_TRUE(sut->start());
  const BusyTask one(*sut, 0, both, {area(0), area(0)}, true);
  const BusyTask other(*sut, 1, both, {area(1), area(1)}, true);
  // One may begin late; if it is never saved, this does not end.
  while (sut->saves() < 5 || saved()[0] <= kInitial || saved()[1] <= kInitial)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST_F(RetainOfBusyTasks, IsSavedThoughAnotherTaskIsStuckWithinACycle) {
  (void)group({7}, {{0, 8}});
  RetainGroup& other = group({1}, {{8, 8}});
  ASSERT_TRUE(sut->start());
  sut->memory().counter(7) = 1;
  *area(0) = 13;
  {
    const BusyTask task(*sut, 1, other, {area(1)});
    while (saved()[1] == kInitial) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(saved()[0], kInitial) << "half a cycle's variables are never saved";
  EXPECT_GT(sut->unsaved(), 0U);
  sut->finish();
  EXPECT_EQ(saved()[0], kInitial);
  EXPECT_EQ(saved()[1], *area(1)) << "also at the end";
}

TEST_F(RetainOfBusyTasks, IsTakenFromWhereAnAreaLives) {
  alignas(8) std::uint64_t registers = 0;
  sut->memory().live_elsewhere(0, std::as_writable_bytes(std::span(&registers, 1)));
  RetainGroup& both = group({0}, {{0, 8}, {8, 8}});
  ASSERT_TRUE(sut->start());
  {
    const BusyTask task(*sut, 0, both, {&registers, area(1)});
    while (sut->saves() < 5) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const auto [count, hours] = saved();
    EXPECT_EQ(count, hours);
  }
  sut->finish();
  EXPECT_EQ(*area(0), registers) << "for the next process, the memory has it, too";
}

TEST_F(Retain, WithoutAFolderLivesInMemoryAndSaysSo) {
  sut = RetainKeeper::make(pool_, "line1", initial(), {}).value();
  ASSERT_TRUE(sut->start());
  EXPECT_THAT(sut->remarks(), ElementsAre(HasSubstr("lost when the power is cut")));
  set(0, 42);
  sut = RetainKeeper::make(pool_, "line1", initial(), {}).value();
  EXPECT_EQ(value(0), 42U);
}

TEST_F(Retain, LivesWhereTheSettingsHaveIt) {
  alignas(8) std::uint64_t registers = 0;
  const auto live = std::as_writable_bytes(std::span(&registers, 1));
  sut = RetainKeeper::make(pool_, "line1", initial(), {.directory = folder_}).value();
  sut->memory().live_elsewhere(0, live);
  ASSERT_TRUE(sut->start());
  EXPECT_EQ(registers, kInitial);
  registers = 42;
  sut.reset();
  forget_memory();
  start_well();
  EXPECT_EQ(value(0), 42U);
}

// A stranger may have scribbled over all of it: then it is the file's turn.
TEST_F(Retain, MemoryWithAnyByteOfItsHeaderSpoiledIsTakenOrLeftAsAWhole) {
  start_well();
  sut.reset();
  const std::string name = pool_memory_name(name_.get(), retain_memory_name("line1"));
  constexpr std::size_t kHeader = 96 + 3 * 80;
  for (std::size_t at = 0; at < kHeader; ++at) {
    for (const unsigned char spoil : {0x01, 0x80, 0xff}) {
      {
        const auto memory = MemoryFile::open(name, 1, MemoryFile::Access::read_write);
        ASSERT_TRUE(memory);
        memory->bytes()[at] ^= static_cast<std::byte>(spoil);
      }
      const auto left = RetainMemory::left_behind(name_.get(), retain_memory_name("line1"));
      if (left) {
        EXPECT_TRUE(check_layout(left->image.layout));
        EXPECT_EQ(left->image.data.size(), left->image.layout.bytes);
      }
      const auto memory = MemoryFile::open(name, 1, MemoryFile::Access::read_write);
      memory->bytes()[at] ^= static_cast<std::byte>(spoil);
    }
  }
}

}  // namespace
}  // namespace plchost
