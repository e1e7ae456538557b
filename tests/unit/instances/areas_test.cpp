// What Areas puts around the cycles of tasks.
#include "instances/runtime/areas/areas.hpp"

#include <array>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "shm/pool/memory_file.hpp"

namespace plchost {
namespace {

using ::testing::HasSubstr;

class AreasUnderTest : public ::testing::Test {
 protected:
  ~AreasUnderTest() override {
    ObjectPool::remove(pool_);
    remove_pool_memories(pool_);
  }

  RTS_HANDLE declare(const char* name, unsigned flags, unsigned bytes, std::vector<Plc_Area_Use> uses = {},
                     void** address = nullptr, const void* initial = nullptr) {
    Plc_Area area{};
    area.dwSize = sizeof area;
    area.dwFlags = flags;
    area.pszName = name;
    area.dwBytes = bytes;
    area.nUses = static_cast<unsigned>(uses.size());
    area.pUses = uses.data();
    area.pInitial = initial;
    area.ppAddress = address;
    return sut.declare(&area, result);
  }
  void task(const std::string& name, std::function<void()> entry) {
    TaskConfig config;
    config.name = name;
    config.entry = std::move(entry);
    tasks.push_back(std::move(config));
  }
  [[nodiscard]] Result<std::string> place(const std::string& settings = {}) {
    settings_ = parse_settings(settings, "l.cfg").value();
    return sut.place({.pool = shared_,
                      .instance = "line1",
                      .application = "Test",
                      .settings = settings_.areas,
                      .retain = retain_},
                     tasks);
  }

  std::string pool_ = "areas-test-" + std::to_string(::getpid());
  ObjectPool shared_ = ObjectPool::create(pool_).value();
  InstanceSettings settings_;
  RetainKeeper::Options retain_;
  Areas sut;
  std::vector<TaskConfig> tasks;
  RTS_RESULT result = ERR_OK;
};

TEST_F(AreasUnderTest, LeavesATaskThatUsesNoneAsItIs) {
  struct Entry {
    void operator()() const {}
  };
  task("With", Entry{});
  task("Without", Entry{});
  declare("out", PLC_AREA_OUTPUT, 8, {{"With", 0, 8, nullptr}});
  declare("data", PLC_AREA_DATA, 8);
  ASSERT_TRUE(place());
  EXPECT_EQ(tasks[0].entry.target<Entry>(), nullptr);
  EXPECT_NE(tasks[1].entry.target<Entry>(), nullptr);
}

TEST_F(AreasUnderTest, OfAnApplicationWithoutAnyChangeNothing) {
  struct Entry {
    void operator()() const {}
  };
  task("Main", Entry{});
  ASSERT_TRUE(place());
  EXPECT_NE(tasks[0].entry.target<Entry>(), nullptr);
}

TEST_F(AreasUnderTest, HaveInitialValuesAndAddresses) {
  const std::array<unsigned char, 8> initial{1, 2, 3, 4, 5, 6, 7, 8};
  task("Main", [] {});
  std::array<void*, 4> address{};
  declare("data", PLC_AREA_DATA, 8, {}, &address[0], initial.data());
  declare("in", PLC_AREA_INPUT, 8, {}, &address[1], initial.data());
  declare("out", PLC_AREA_OUTPUT, 8, {}, &address[2], initial.data());
  declare("kept", PLC_AREA_RETAIN, 8, {}, &address[3], initial.data());
  EXPECT_EQ(address[0], nullptr) << "not before all are declared";
  ASSERT_TRUE(place());
  for (const void* at : address) {
    ASSERT_NE(at, nullptr);
    EXPECT_EQ(std::memcmp(at, initial.data(), 8), 0);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(at) % 8, 0U);
  }
}

TEST_F(AreasUnderTest, ThatAreKeptAreSavedByTheTaskItselfIfItsCyclesHaveNoPause) {
  const std::string folder = ::testing::TempDir() + pool_;
  retain_ = {.directory = folder,
             .interval = std::chrono::milliseconds(10),
             .postpone = std::chrono::milliseconds(2)};
  void* kept = nullptr;
  task("Busy", [&] { std::this_thread::sleep_for(std::chrono::milliseconds(2)); });
  tasks.back().iec_priority = 5;
  task("Stuck", [] {});
  Plc_Area_Use busy{};
  busy.pszTask = "Busy";
  Plc_Area_Use stuck{};
  stuck.pszTask = "Stuck";
  const RTS_HANDLE handle = declare("count", PLC_AREA_RETAIN, 8, {busy}, &kept);
  declare("other", PLC_AREA_RETAIN, 8, {stuck});
  ASSERT_TRUE(place());
  Plc_Area_State state{};
  state.dwSize = sizeof state;
  while (sut.state(handle, state) == ERR_OK && state.qwSaves < 4) {
    ++*static_cast<std::uint64_t*>(kept);
    tasks[0].entry();
  }
  EXPECT_EQ(state.qwUnsaved, 0U);
  sut.finish();
  std::filesystem::remove_all(folder);
}

TEST_F(AreasUnderTest, OfACycleThatThrowsAreNotPutOut) {
  std::array<void*, 2> address{};
  bool fails = false;
  task("High", [&] {
    ++*static_cast<int*>(address[0]);
    if (fails) throw std::runtime_error("a fault");
  });
  int seen = 0;
  task("Low", [&] { seen = *static_cast<int*>(address[1]); });
  declare("out", PLC_AREA_OUTPUT, 8, {{"High", 0, 8, &address[0]}, {"Low", 0, 0, &address[1]}});
  ASSERT_TRUE(place());
  tasks[0].entry();
  tasks[1].entry();
  EXPECT_EQ(seen, 1);
  fails = true;
  EXPECT_THROW(tasks[0].entry(), std::runtime_error);
  tasks[1].entry();
  EXPECT_EQ(seen, 1);
}

TEST_F(AreasUnderTest, HaveTheAddressOfTheTaskThatAsksWithinItsCycle) {
  std::array<void*, 2> told{};
  std::array<void*, 2> asked{};
  RTS_HANDLE handle = RTS_INVALID_HANDLE;
  task("High", [&] { asked[0] = sut.address(handle); });
  task("Low", [&] { asked[1] = sut.address(handle); });
  handle = declare("in", PLC_AREA_INPUT, 8, {{"High", 0, 0, &told[0]}, {"Low", 0, 0, &told[1]}});
  ASSERT_TRUE(place());
  tasks[0].entry();
  tasks[1].entry();
  EXPECT_EQ(asked, told);
  EXPECT_NE(told[0], told[1]);
  EXPECT_EQ(sut.address(handle), nullptr) << "outside of a cycle";
  EXPECT_EQ(sut.address(RTS_INVALID_HANDLE), nullptr);
  EXPECT_EQ(sut.address(nullptr), nullptr);
}

TEST_F(AreasUnderTest, InOneObjectAreOneImage) {
  std::array<void*, 2> address{};
  task("Main", [&] {
    ++*static_cast<std::uint64_t*>(address[0]);
    ++*static_cast<std::uint64_t*>(address[1]);
  });
  declare("a", PLC_AREA_OUTPUT, 8, {}, &address[0]);
  declare("b", PLC_AREA_OUTPUT, 8, {}, &address[1]);
  ASSERT_TRUE(place("[SysMem]\nLinux.Area.0.Flags=8\nLinux.Area.0.Object=io\nLinux.Area.0.Size=24\n"));
  plc_image image;
  ASSERT_EQ(plc_image_open(pool_.c_str(), "io", 24, PLC_IMAGE_READ, &image), 0);
  std::array<std::uint64_t, 3> words{};
  EXPECT_EQ(plc_image_read(&image, words.data(), nullptr), PLC_IMAGE_OK) << "the initial values";
  tasks[0].entry();
  ASSERT_EQ(plc_image_read(&image, words.data(), nullptr), PLC_IMAGE_OK);
  EXPECT_EQ(words, (std::array<std::uint64_t, 3>{1, 1, 0}));
  plc_image_close(&image);
}

TEST_F(AreasUnderTest, AreRefusedOneTooManyTwiceAndTooLate) {
  task("Main", [] {});
  for (int i = 0; i < PLC_MAX_AREAS; ++i) {
    EXPECT_NE(declare(fmt::format("a{}", i).c_str(), PLC_AREA_DATA, 8), RTS_INVALID_HANDLE);
  }
  EXPECT_EQ(declare("a0", PLC_AREA_DATA, 8), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_DUPLICATE);
  EXPECT_EQ(declare("more", PLC_AREA_DATA, 8), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_NOMEMORY);
  ASSERT_TRUE(place());
  declare("late", PLC_AREA_DATA, 8);
  EXPECT_EQ(result, ERR_NOTINITIALIZED);
}

TEST_F(AreasUnderTest, SayHowTheyAre) {
  task("Main", [] {});
  const RTS_HANDLE kept = declare("kept", PLC_AREA_RETAIN, 8);
  Plc_Area_State state{};
  state.dwSize = sizeof state;
  EXPECT_EQ(sut.state(kept, state), ERR_NOTINITIALIZED);
  ASSERT_TRUE(place());
  EXPECT_EQ(sut.state(kept, state), ERR_OK);
  EXPECT_EQ(state.dwOrigin, PLC_AREA_INITIAL);
  state.dwSize = 1;
  EXPECT_EQ(sut.state(kept, state), ERR_PARAMETER);
  EXPECT_EQ(sut.state(RTS_INVALID_HANDLE, state), ERR_PARAMETER);
}

}  // namespace
}  // namespace plchost
