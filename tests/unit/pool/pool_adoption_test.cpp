// Memories whose file and whose entry in the pool's table do not go together.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <grp.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/files/pool_files.hpp"
#include "shm/plc_process_image.h"
#include "shm/plc_reference_clock.h"
#include "shm/pool/object_pool.hpp"
#include "tests/support/in_a_child.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

/// An image, as firmware makes it that knows only the header.
class FirmwareImage {
 public:
  FirmwareImage(const std::string& pool, const std::string& name, unsigned size) {
    EXPECT_EQ(plc_image_open(pool.c_str(), name.c_str(), size, PLC_IMAGE_WRITE, &image_), 0);
  }
  ~FirmwareImage() { plc_image_close(&image_); }
  FirmwareImage(const FirmwareImage&) = delete;
  FirmwareImage& operator=(const FirmwareImage&) = delete;
  void write(char value) {
    const std::string bytes(image_.size, value);
    plc_image_write(&image_, bytes.data());
  }
  [[nodiscard]] const plc_image& get() const { return image_; }

 private:
  plc_image image_{};
};

class PoolAdoptionTest : public testing::Test {
 protected:
  PoolAdoptionTest() : pool_(std::move(ObjectPool::create(name_.get(), {.max_objects = 512}).value())) {}
  [[nodiscard]] std::string file(const std::string& name) const {
    return "/dev/shm/" + pool_memory_name(name_.get(), name);
  }
  /// The latest image in a memory that was opened through the pool.
  static std::string read(const SharedMemory& memory, unsigned size) {
    plc_image image{};
    image.header = reinterpret_cast<plc_image_header*>(memory.bytes().data());
    image.size = size;
    std::string bytes(size, '?');
    return plc_image_read(&image, bytes.data(), nullptr) == PLC_IMAGE_OK ? bytes : "";
  }
  UniquePoolName name_;
  ObjectPool pool_;
};

TEST_F(PoolAdoptionTest, WhatFirmwareMadeWithAHeaderAloneIsAnObjectAtTheNextLook) {
  const FirmwareImage image(name_.get(), "terminal1.in", 16);
  plc_reference_clock* clock = nullptr;
  ASSERT_EQ(plc_reference_clock_open(name_.get().c_str(), "bus1", &clock), 0);
  std::ofstream(file("other")) << std::string(5000, 'x');
  EXPECT_TRUE(pool_.list()->empty());
  EXPECT_FALSE(pool_.tidy().lost);
  const auto object = pool_.look_at("terminal1.in");
  ASSERT_TRUE(object) << object.error().describe();
  EXPECT_EQ(object->type, ObjectType::memory);
  EXPECT_EQ(object->size, plc_image_bytes(16));
  EXPECT_EQ(object->mode, 0660U);
  EXPECT_TRUE(object->kept);
  EXPECT_EQ(pool_.look_at("bus1")->size, sizeof(plc_reference_clock));
  EXPECT_EQ(pool_.list()->size(), 2U) << "a file without a magic number stays a file";
  plc_reference_clock_close(clock);
}

TEST_F(PoolAdoptionTest, AnImageThatComesLaterIsFoundByALaterLook) {
  EXPECT_FALSE(pool_.tidy().lost);
  const FirmwareImage image(name_.get(), "late", 16);
  EXPECT_FALSE(pool_.tidy().lost);
  EXPECT_TRUE(pool_.look_at("late"));
}

TEST_F(PoolAdoptionTest, ToCreateWhatFirmwareHasMadeOpensIt) {
  FirmwareImage image(name_.get(), "in", 16);
  image.write('a');
  EXPECT_EQ(pool_.create_memory("in", 5000).error().code, ErrorCode::wrong_size);
  const auto sut = pool_.create_memory("in", plc_image_bytes(16));
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_FALSE(sut->made);
  image.write('b');
  EXPECT_EQ(read(sut->object, 16), std::string(16, 'b')) << "it is the file that firmware writes";
  EXPECT_EQ(plc_image_gone(&image.get(), name_.get().c_str(), "in"), 0);
}

TEST_F(PoolAdoptionTest, ToRemoveWhatFirmwareHasMadeNeedsNoLookBefore) {
  const FirmwareImage image(name_.get(), "in", 16);
  EXPECT_TRUE(pool_.remove_object("in"));
  EXPECT_NE(plc_image_gone(&image.get(), name_.get().c_str(), "in"), 0);
  EXPECT_EQ(pool_.remove_object("in").error().code, ErrorCode::not_found);
}

TEST_F(PoolAdoptionTest, FirmwareAndPoolMeanTheSameFileByEachName) {
  for (const std::string name : {"a b", "line1/in", "100%", "F\u00fcller", "...", "*"}) {
    const FirmwareImage image(name_.get(), name, 16);
    const auto memory = pool_.open_memory(name);
    ASSERT_TRUE(memory) << memory.error().describe();
    EXPECT_EQ(memory->bytes().size(), plc_image_bytes(16));
  }
  plc_image none;
  EXPECT_EQ(plc_image_open(name_.get().c_str(), "a\nb", 16, PLC_IMAGE_READ, &none), EINVAL);
  const std::string longest(PLC_IMAGE_MAX_NAME, 'x');
  const FirmwareImage image(name_.get(), longest, 16);
  EXPECT_TRUE(pool_.open_memory(longest));
  EXPECT_EQ(plc_image_open(name_.get().c_str(), (longest + "x").c_str(), 16, PLC_IMAGE_READ, &none),
            ENAMETOOLONG);
}

TEST_F(PoolAdoptionTest, ToOpenWhatFirmwareHasMadeNeedsNoLookBefore) {
  const FirmwareImage image(name_.get(), "in", 16);
  EXPECT_EQ(pool_.open_memory("in")->bytes().size(), plc_image_bytes(16));
  EXPECT_EQ(pool_.open_memory("none").error().code, ErrorCode::not_found);
}

TEST_F(PoolAdoptionTest, WhoseFileWasRemovedIsNoObjectAnyMore) {
  {
    const FirmwareImage image(name_.get(), "in", 16);
    ASSERT_TRUE(pool_.open_memory("in"));
  }
  std::filesystem::remove(file("in"));
  EXPECT_EQ(pool_.open_memory("in").error().code, ErrorCode::not_found);
  EXPECT_FALSE(pool_.look_at("in"));
  const FirmwareImage larger(name_.get(), "in", 64);
  EXPECT_EQ(pool_.open_memory("in")->bytes().size(), plc_image_bytes(64));
  std::filesystem::remove(file("in"));
  const FirmwareImage smaller(name_.get(), "in", 8);
  EXPECT_EQ(pool_.open_memory("in")->bytes().size(), plc_image_bytes(8)) << "though it had an entry";
}

TEST_F(PoolAdoptionTest, RemovingTheObjectRemovesTheFile) {
  const FirmwareImage image(name_.get(), "in", 16);
  ASSERT_TRUE(pool_.open_memory("in"));
  EXPECT_TRUE(pool_.remove_object("in"));
  EXPECT_EQ(plc_image_gone(&image.get(), name_.get().c_str(), "in"), 1);
}

TEST_F(PoolAdoptionTest, WhatIsLeftOfAnotherPoolIsNotTaken) {
  std::ofstream(file("m")) << std::string(10, 'x');
  const auto sut = pool_.create_memory("m", 10);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_TRUE(sut->made);
  EXPECT_TRUE(std::ranges::all_of(sut->object.bytes(), [](std::byte b) { return b == std::byte{0}; }));
}

TEST_F(PoolAdoptionTest, AReplacedMemoryHasItsContentsFromTheFirstMoment) {
  const auto fill = [](char with) {
    return [with](std::span<std::byte> bytes) -> Result<void> {
      std::ranges::fill(bytes, static_cast<std::byte>(with));
      return {};
    };
  };
  const auto old = pool_.replace_memory("line1.retain", 100, fill('a'));
  ASSERT_TRUE(old) << old.error().describe();
  EXPECT_TRUE(pool_.look_at("line1.retain")->kept);
  const auto sut = pool_.replace_memory("line1.retain", 200, fill('b'));
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_EQ(sut->bytes().size(), 200U);
  EXPECT_EQ(sut->bytes()[199], std::byte{'b'});
  EXPECT_FALSE(old->valid());
  EXPECT_EQ(old->bytes()[99], std::byte{'a'}) << "its holder keeps it";
  EXPECT_EQ(pool_.look_at("line1.retain")->reference_count, 1U);
  const auto event = pool_.create_shared_event("e");
  EXPECT_EQ(pool_.replace_memory("e", 10, fill('c')).error().code, ErrorCode::wrong_type);
}

TEST_F(PoolAdoptionTest, APreparedMemoryChangesNothingUntilItReplacesAnother) {
  const auto old = pool_.create_memory("line1.retain", 100, {.keep = true});
  ASSERT_TRUE(old) << old.error().describe();
  (void)pool_.prepare_memory("line1.retain", 200).value();
  auto prepared = pool_.prepare_memory("line1.retain", 200);
  ASSERT_TRUE(prepared) << prepared.error().describe();
  prepared->bytes()[199] = std::byte{'b'};
  EXPECT_EQ(pool_.look_at("line1.retain")->size, 100U);
  const std::byte* const address = prepared->bytes().data();
  const auto sut = pool_.replace_memory("line1.retain", *prepared);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_EQ(sut->bytes().data(), address);
  EXPECT_EQ(pool_.open_memory("line1.retain")->bytes()[199], std::byte{'b'});
  EXPECT_FALSE(old->object.valid());
}

TEST_F(PoolAdoptionTest, AMemoryIsMadeWithItsFirstContents) {
  const std::array contents{std::byte{1}, std::byte{2}};
  auto made = pool_.create_memory("m", 4, {.keep = true}, contents);
  ASSERT_TRUE(made) << made.error().describe();
  EXPECT_TRUE(made->made);
  made->object.bytes()[0] = std::byte{9};
  const auto again = pool_.create_memory("m", 4, {.keep = true}, contents);
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->made);
  const std::array<std::byte, 4> wanted{std::byte{9}, std::byte{2}, std::byte{0}, std::byte{0}};
  EXPECT_TRUE(std::ranges::equal(again->object.bytes(), wanted)) << "of one that is there they stay";
  EXPECT_EQ(pool_.create_memory("n", 1, {}, contents).error().code, ErrorCode::wrong_size);
}

TEST_F(PoolAdoptionTest, WhoIsKilledWhileHeTakesAnImageInLeavesItInItsPlace) {
  constexpr unsigned kSeed = 20;
  constexpr int kImages = 100;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 20; ++round) {
    const auto name = [&](int i) { return "r" + std::to_string(round) + "." + std::to_string(i); };
    for (int i = 0; i < kImages; ++i) const FirmwareImage made(name_.get(), name(i), 8);
    const pid_t child = ::fork();
    if (child == 0) {
      auto pool = ObjectPool::attach(name_.get());
      for (int i = 0; pool && i < kImages; ++i) (void)pool->open_memory(name(i));
      for (;;) ::pause();
    }
    std::this_thread::sleep_for(std::chrono::microseconds(500 + random() % 4000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    for (int i = 0; i < kImages; ++i) {
      ASSERT_TRUE(std::filesystem::exists(file(name(i)))) << name(i);
      ASSERT_TRUE(pool_.open_memory(name(i))) << name(i);
      ASSERT_TRUE(pool_.remove_object(name(i)));
    }
  }
}

TEST_F(PoolAdoptionTest, NamesOfManyLettersBeyondAsciiAreFileNamesAsTheyAre) {
  std::string name;
  for (int i = 0; i < 47; ++i) name += "ü";
  const auto sut = pool_.create_memory(name, 10);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_TRUE(std::filesystem::exists("/dev/shm/" + name_.get() + ".memory." + name));
  EXPECT_EQ(memory_of_file(name_.get(), pool_memory_name(name_.get(), "a/b 100%ü")), "a/b 100%ü");
  EXPECT_EQ(memory_of_file(name_.get(), name_.get() + ".memory.%61"), std::nullopt)
      << "another way to write it";
  EXPECT_EQ(memory_of_file(name_.get(), name_.get() + ".memory.a%2"), std::nullopt);
  EXPECT_EQ(memory_of_file(name_.get(), name_.get()), std::nullopt);
  const auto too_long = pool_.create_memory(std::string(95, '/'), 10);
  EXPECT_EQ(too_long.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(too_long.error().message, HasSubstr("255 are allowed"));
}

/// Objects of users that are in the pool's group, and of one that is not.
class MemoriesOfOtherUsers : public testing::Test {
 protected:
  static constexpr gid_t kGroup = 65534;
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "needs root to become other users";
    pool_.emplace(
        std::move(ObjectPool::create(name_.get(), {.rights = {.group = kGroup, .mode = 0660}}).value()));
  }
  /// The answer of `body` in a process of that user, which then ends without closing anything; "" is good.
  static std::string as_user(uid_t user, gid_t group, const std::function<std::string()>& body) {
    return in_a_child([&] {
      const bool other = ::setgroups(0, nullptr) == 0 && ::setgid(group) == 0 && ::setuid(user) == 0;
      return other ? body() : "cannot become another user";
    });
  }
  [[nodiscard]] std::string create(mode_t mode, char content) const {
    static SharedMemory held;  // to the death of the process
    auto pool = ObjectPool::attach(name_.get());
    if (!pool) return pool.error().describe();
    auto memory = pool->create_memory("m", 100, {.mode = mode});
    if (!memory) return memory.error().describe();
    held = std::move(memory->object);
    const bool zero = std::ranges::all_of(held.bytes(), [](std::byte b) { return b == std::byte{0}; });
    std::ranges::fill(held.bytes(), static_cast<std::byte>(content));
    return !memory->made ? "was there" : zero ? "" : "not zero";
  }
  UniquePoolName name_;
  std::optional<ObjectPool> pool_;
};

TEST_F(MemoriesOfOtherUsers, TheFileOfADeadOneIsUsedAgainByTheNextWhoMayWriteIt) {
  EXPECT_EQ(as_user(65534, kGroup, [&] { return create(0660, 'a'); }), "");
  EXPECT_EQ(as_user(65533, kGroup, [&] { return create(0660, 'b'); }), "");
  EXPECT_EQ(as_user(65533, kGroup, [&] { return create(0660, 'c'); }), "");
  EXPECT_EQ(as_user(65534, kGroup, [&] { return create(0660, 'd'); }), "");
}

TEST_F(MemoriesOfOtherUsers, WhoMayNotWriteTheFileOfADeadOneIsToldWhatToDo) {
  EXPECT_EQ(as_user(65534, kGroup, [&] { return create(0600, 'a'); }), "");
  const auto sut = [&] { return as_user(65533, kGroup, [&] { return create(0660, 'b'); }); };
  EXPECT_THAT(sut(), testing::AllOf(HasSubstr("left of user 65534"), HasSubstr("root")));
  EXPECT_THAT(sut(), HasSubstr("left of user 65534")) << "also the second time";
  EXPECT_EQ(as_user(65533, kGroup,
                    [&] {
                      const auto pool = ObjectPool::attach(name_.get());
                      return std::string(to_string(pool->open_memory("m").error().code));
                    }),
            to_string(ErrorCode::not_found));
  EXPECT_TRUE(pool_->list()->empty()) << "it is nobody's object";
  EXPECT_FALSE(pool_->tidy().lost) << "root may remove it";
  EXPECT_EQ(sut(), "");
}

TEST_F(MemoriesOfOtherUsers, AnImageOfWhoMayNotWriteThePoolIsNotTaken) {
  EXPECT_EQ(as_user(65533, 65533,
                    [&] {
                      const FirmwareImage image(name_.get(), "in", 16);
                      return std::string();
                    }),
            "");
  EXPECT_FALSE(pool_->tidy().lost);
  EXPECT_FALSE(pool_->look_at("in"));
  const auto sut = pool_->create_memory("in", plc_image_bytes(16));
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_TRUE(sut->made) << "a new file, which that user cannot read";
}

}  // namespace
}  // namespace plchost
