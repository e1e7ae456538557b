// The copies that Areas puts around the cycles of tasks.
#include "instances/runtime/memory/areas.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>

#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/plc_process_image.h"
#include "tests/support/whole_cycle.hpp"
#include "tests/unit/instances/areas_under_test.hpp"

namespace plchost {
namespace {

using ::testing::HasSubstr;

bool is_mapped_from(const void* address, const std::string& file) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t begin = 0;
    std::uintptr_t end = 0;
    if (std::sscanf(line.c_str(), "%lx-%lx", &begin, &end) != 2) continue;
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    if (at >= begin && at < end) return line.contains(file);
  }
  return false;
}

// The writer of an output, or another object of the retain memory's name, is not looked for before.
TEST_F(AreasUnderTest, ThatCannotBePlacedLeaveThePoolAsItWas) {
  const auto taken = shared_.create_memory("taken", plc_image_bytes(8), {.keep = true});
  ASSERT_TRUE(taken);
  const UniqueFd writer(
      ::open(MemoryFile::path(pool_memory_name(pool_, "taken")).c_str(), O_RDONLY | O_CLOEXEC));
  ASSERT_EQ(::flock(writer.get(), LOCK_EX | LOCK_NB), 0);
  task("Main", [] {});
  declare("data", PLC_AREA_MEMORY, 8);
  declare("out", PLC_AREA_OUTPUT, 8, {{"Main", 0, 8, nullptr}});
  const auto placed = place(
      "[SysMem]\nLinux.Area.0.Flags=0x10\nLinux.Area.0.Object=fresh\nLinux.Area.0.Size=8\n"
      "Linux.Area.1.Flags=0x08\nLinux.Area.1.Object=taken\nLinux.Area.1.Size=8\n");
  ASSERT_FALSE(placed);
  EXPECT_THAT(placed.error().message, HasSubstr("has a writer already"));
  EXPECT_EQ(shared_.look_at("fresh").error().code, ErrorCode::not_found);
  EXPECT_FALSE(std::filesystem::exists(MemoryFile::path(pool_memory_name(pool_, "fresh"))));
  EXPECT_TRUE(shared_.look_at("taken")) << "it was there before";
}

TEST_F(AreasUnderTest, WhoseRetainMemoryHasNoPlaceLeaveThePoolAsItWas) {
  const auto other = shared_.create_semaphore("line1.retain", 1);
  ASSERT_TRUE(other);
  task("Main", [] {});
  declare("data", PLC_AREA_MEMORY, 8);
  declare("kept", PLC_AREA_RETAIN, 8);
  const auto placed =
      place("[SysMem]\nLinux.Area.0.Flags=0x10\nLinux.Area.0.Object=fresh\nLinux.Area.0.Size=8\n");
  ASSERT_FALSE(placed) << *placed;
  EXPECT_EQ(placed.error().code, ErrorCode::wrong_type);
  EXPECT_EQ(shared_.look_at("fresh").error().code, ErrorCode::not_found);
  EXPECT_EQ(shared_.look_at("line1.retain")->type, ObjectType::semaphore);
}

TEST_F(AreasUnderTest, OfAStartThatFailsAfterwardsLeaveThePoolAsItWas) {
  const auto taken = shared_.create_memory("there", 8, {.keep = true});
  ASSERT_TRUE(taken);
  task("Main", [] {});
  declare("data", PLC_AREA_DATA, 8);
  declare("memory", PLC_AREA_MEMORY, 8);
  declare("out", PLC_AREA_OUTPUT, 8, {{"Main", 0, 8, nullptr}});
  declare("kept", PLC_AREA_RETAIN, 8);
  const std::string settings =
      "[SysMem]\nLinux.Area.0.Flags=0x10\nLinux.Area.0.Object=fresh\nLinux.Area.0.Size=8\n"
      "Linux.Area.1.Flags=0x01\nLinux.Area.1.Object=there\nLinux.Area.1.Size=8\n"
      "Linux.Area.2.Flags=0x08\nLinux.Area.2.Object=out\nLinux.Area.2.Size=8\n";
  for (const bool fails : {true, false}) {
    const auto before = tasks;
    const auto placed = fails ? place_only(settings) : place(settings);
    ASSERT_TRUE(placed) << placed.error().describe();
    sut = Areas();
    tasks = before;
    for (const char* name : {"fresh", "out", "line1.retain"}) {
      EXPECT_EQ(shared_.look_at(name).has_value(), !fails) << name;
      EXPECT_EQ(std::filesystem::exists(MemoryFile::path(pool_memory_name(pool_, name))), !fails) << name;
    }
    EXPECT_TRUE(shared_.look_at("there")) << "it was there before";
  }
}

// However the process ends meanwhile, the next one finds nothing, or a memory with these values.
TEST_F(AreasUnderTest, AreSeenByOthersWithTheirInitialValuesOnly) {
  const std::array<unsigned char, 8> initial{1, 2, 3, 4, 5, 6, 7, 8};
  task("Main", [] {});
  declare("data", PLC_AREA_MEMORY, 8, {}, nullptr, initial.data());
  // It takes some ms to place, and lies between the memory before and the values in that.
  declare("large", PLC_AREA_DATA, 16 * 1024 * 1024);
  std::array<unsigned char, 8> seen{};
  std::atomic<bool> looks{false};
  std::thread other([&] {
    const auto pool = ObjectPool::attach(pool_);
    looks = true;
    for (auto memory = pool->open_memory("fresh");; memory = pool->open_memory("fresh")) {
      if (!memory) continue;
      std::memcpy(seen.data(), memory->bytes().data(), seen.size());
      return;
    }
  });
  while (!looks) std::this_thread::yield();
  const auto before = tasks;
  const auto place_fresh = [&] {
    return place("[SysMem]\nLinux.Area.0.Flags=0x10\nLinux.Area.0.Object=fresh\nLinux.Area.0.Size=8\n");
  };
  auto placed = place_fresh();
  while (!placed &&
         placed.error().code == ErrorCode::timed_out) {  // the other one stands still with the lock
    sut = Areas();
    tasks = before;
    placed = place_fresh();
  }
  if (!placed) (void)shared_.create_memory("fresh", 8, {.keep = true});
  other.join();
  ASSERT_TRUE(placed) << placed.error().describe();
  EXPECT_EQ(seen, initial);
}

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
    run_whole_cycle(tasks[0]);
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
  run_whole_cycle(tasks[0]);
  run_whole_cycle(tasks[1]);
  EXPECT_EQ(seen, 1);
  fails = true;
  EXPECT_THROW(run_whole_cycle(tasks[0]), std::runtime_error);
  run_whole_cycle(tasks[1]);
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
  run_whole_cycle(tasks[0]);
  run_whole_cycle(tasks[1]);
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
  run_whole_cycle(tasks[0]);
  ASSERT_EQ(plc_image_read(&image, words.data(), nullptr), PLC_IMAGE_OK);
  EXPECT_EQ(words, (std::array<std::uint64_t, 3>{1, 1, 0}));
  plc_image_close(&image);
}

TEST_F(AreasUnderTest, AreRefusedOneTooManyAndTwice) {
  task("Main", [] {});
  for (int i = 0; i < PLC_MAX_AREAS; ++i) {
    EXPECT_NE(declare(fmt::format("a{}", i).c_str(), PLC_AREA_DATA, 8), RTS_INVALID_HANDLE);
  }
  EXPECT_EQ(declare("a0", PLC_AREA_DATA, 8), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_DUPLICATE);
  EXPECT_EQ(declare("more", PLC_AREA_DATA, 8), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_NOMEMORY);
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

/// Areas in files.
class AreasInFiles : public AreasUnderTest {
 protected:
  AreasInFiles() {
    std::filesystem::create_directories(folder_);
    std::ofstream(file_) << std::string(8192, 'x');
    task("Main", [] {});
  }
  ~AreasInFiles() override { std::filesystem::remove_all(folder_); }
  static std::string area(int number, const char* flags, const std::string& where) {
    return fmt::format("Linux.Area.{0}.Flags={1}\nLinux.Area.{0}.Size=0x1000\nLinux.Area.{0}.{2}\n", number,
                       flags, where);
  }
  static std::string device(int number, const char* flags, const std::string& path, unsigned address = 0) {
    return area(number, flags, fmt::format("Device={}\nLinux.Area.{}.Address={:#x}", path, number, address));
  }
  void expect_overlap(const std::string& settings, const std::string& with) {
    const auto placed = place("[SysMem]\n" + settings);
    ASSERT_FALSE(placed);
    EXPECT_THAT(placed.error().message, ::testing::AllOf(HasSubstr("l.cfg:6: [SysMem] Area.1"),
                                                         HasSubstr("same file"), HasSubstr(with)));
  }
  std::string folder_ = ::testing::TempDir() + pool_;
  std::string file_ = folder_ + "/registers";
};

TEST_F(AreasInFiles, ThatLieOnEachOtherThroughASymbolicLinkAreRefused) {
  std::filesystem::create_symlink(file_, folder_ + "/link");
  declare("data", PLC_AREA_DATA, 8);
  declare("memory", PLC_AREA_MEMORY, 8);
  expect_overlap(device(0, "1", file_) + device(1, "0x10", folder_ + "/link"), "Area.0 of l.cfg:2");
}

TEST_F(AreasInFiles, ThatLieOnEachOtherThroughAHardLinkAreRefused) {
  std::filesystem::create_hard_link(file_, folder_ + "/link");
  declare("data", PLC_AREA_DATA, 8);
  declare("memory", PLC_AREA_MEMORY, 8);
  expect_overlap(device(0, "1", file_) + device(1, "0x10", folder_ + "/link", 0xff8), "Area.0 of l.cfg:2");
}

TEST_F(AreasInFiles, ThatLieBesideEachOtherInOneFileAreNot) {
  std::filesystem::create_hard_link(file_, folder_ + "/link");
  declare("data", PLC_AREA_DATA, 8);
  declare("memory", PLC_AREA_MEMORY, 8);
  EXPECT_TRUE(place("[SysMem]\n" + device(0, "1", file_) + device(1, "0x10", folder_ + "/link", 0x1000)));
}

TEST_F(AreasInFiles, AnObjectGivenAsADeviceTooIsRefused) {
  declare("data", PLC_AREA_DATA, 8);
  declare("memory", PLC_AREA_MEMORY, 8);
  const auto settings = device(1, "1", "/dev/shm/" + pool_memory_name(pool_, "registers"));
  ASSERT_TRUE(shared_.create_memory("registers", 0x1000, {.keep = true}));
  const auto placed = place("[SysMem]\n" + area(0, "0x10", "Object=registers") + settings);
  ASSERT_FALSE(placed);
  EXPECT_THAT(placed.error().message, ::testing::AllOf(HasSubstr("same file"), HasSubstr("l.cfg:")));
}

TEST_F(AreasInFiles, ThePoolItselfIsNoDevice) {
  declare("data", PLC_AREA_DATA, 8);
  std::filesystem::create_symlink("/dev/shm/" + pool_, folder_ + "/link");
  const auto placed = place("[SysMem]\n" + device(0, "1", folder_ + "/link"));
  ASSERT_FALSE(placed);
  EXPECT_THAT(placed.error().message, ::testing::AllOf(HasSubstr("l.cfg:2: [SysMem] Area.0: " + folder_),
                                                       HasSubstr("choose another file")));
}

TEST_F(AreasInFiles, ThatAreCutShortAreToldOnce) {
  MemoryGuard::watch_process();
  void* data = nullptr;
  declare("data", PLC_AREA_DATA, 8, {}, &data);
  ASSERT_TRUE(place("[SysMem]\n" + device(0, "1", file_)));
  EXPECT_THAT(sut.look_for_losses(), ::testing::IsEmpty());
  std::filesystem::resize_file(file_, 0);
  EXPECT_EQ(*static_cast<volatile char*>(data), 0);
  EXPECT_THAT(sut.look_for_losses(), ::testing::ElementsAre(::testing::AllOf(
                                         HasSubstr("l.cfg:2: [SysMem] Area.0"), HasSubstr(file_))));
  EXPECT_THAT(sut.look_for_losses(), ::testing::IsEmpty());
}

TEST_F(AreasInFiles, TheRetainVariablesOfTheInstanceAreNoDevice) {
  std::filesystem::create_directories(folder_);
  ASSERT_TRUE(shared_.create_memory("line1.retain", 0x2000, {.keep = true}));
  declare("kept", PLC_AREA_RETAIN, 8);
  declare("data", PLC_AREA_DATA, 8);
  const auto placed =
      place("[SysMem]\n" + device(0, "1", "/dev/shm/" + pool_memory_name(pool_, "line1.retain")));
  ASSERT_FALSE(placed);
  EXPECT_THAT(placed.error().message, HasSubstr("the retain variables"));
}

TEST_F(AreasInFiles, OfAllKindsMayLieInOneFileOneBehindTheOther) {
  void* data = nullptr;
  void* input = nullptr;
  void* output = nullptr;
  declare("data", PLC_AREA_DATA, 8, {}, &data);
  declare("out", PLC_AREA_OUTPUT, 12, {}, &output);
  declare("in", PLC_AREA_INPUT, 8, {}, &input);
  tasks.clear();
  task("Main", [&] { std::memcpy(output, input, 8); });
  const auto placed = place("[SysMem]\n" + device(0, "0x0EFF", file_));
  ASSERT_TRUE(placed) << placed.error().describe();
  ASSERT_TRUE(data != nullptr && output != nullptr && input != nullptr);
  std::memcpy(data, "data....", 8);
  std::fstream(file_).seekp(24).write("12345678", 8);
  run_whole_cycle(tasks[0]);
  std::string bytes(40, '\0');
  std::ifstream(file_).read(bytes.data(), 40);
  EXPECT_EQ(bytes.substr(0, 16), "data....12345678");
  EXPECT_EQ(bytes.substr(20, 20), "xxxx12345678xxxxxxxx") << "nothing else is written";
}

// The one character device of every host that can be mapped: as firmware's registers are, if there were any
// here.
TEST_F(AreasInFiles, InACharacterDeviceAreMappedFromIt) {
  void* data = nullptr;
  void* input = nullptr;
  void* output = nullptr;
  const std::array<unsigned char, 8> initial{1, 2, 3, 4, 5, 6, 7, 8};
  declare("data", PLC_AREA_DATA, 8, {}, &data, initial.data());
  declare("in", PLC_AREA_INPUT, 8, {}, &input, initial.data());
  declare("out", PLC_AREA_OUTPUT, 8, {}, &output);
  tasks.clear();
  task("Main", [&] { std::memset(output, 0x5a, 8); });
  const auto placed = place("[SysMem]\n" + device(0, "0xf", "/dev/zero"));
  ASSERT_TRUE(placed) << placed.error().describe();
  ASSERT_TRUE(data != nullptr && input != nullptr && output != nullptr);
  EXPECT_TRUE(is_mapped_from(data, "/dev/zero")) << "and no memory of the process";
  EXPECT_EQ(*static_cast<std::uint64_t*>(data), 0U) << "values in a device stay";
  EXPECT_EQ(std::memcmp(input, initial.data(), 8), 0);
  run_whole_cycle(tasks[0]);
  EXPECT_EQ(*static_cast<std::uint64_t*>(input), 0U) << "inputs are read from it at the start of a cycle";
}

TEST_F(AreasInFiles, ACharacterDeviceThatCannotBeMappedIsRefusedWithTheLine) {
  declare("data", PLC_AREA_DATA, 8);
  const auto placed = place("[SysMem]\n" + device(0, "1", "/dev/null"));
  ASSERT_FALSE(placed);
  EXPECT_THAT(placed.error().message, ::testing::AllOf(HasSubstr("l.cfg:2"), HasSubstr("/dev/null")));
}

}  // namespace
}  // namespace plchost
