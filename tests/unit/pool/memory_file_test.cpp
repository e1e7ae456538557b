#include "shm/files/memory_file.hpp"

#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using Access = MemoryFile::Access;

class MemoryFileTest : public testing::Test {
 protected:
  [[nodiscard]] std::string path() const { return "/dev/shm/" + name_.get(); }
  UniquePoolName name_;
};

TEST_F(MemoryFileTest, IsZeroFilledAndOfTheSizeAskedFor) {
  const auto sut = MemoryFile::create(name_.get(), 10'000);
  ASSERT_TRUE(sut) << sut.error().describe();
  EXPECT_EQ(sut->bytes().size(), 10'000U);
  EXPECT_TRUE(std::ranges::all_of(sut->bytes(), [](std::byte b) { return b == std::byte{0}; }));
}

TEST_F(MemoryFileTest, HasItsMemoryFromTheStart) {
  const auto sut = MemoryFile::create(name_.get(), 1 << 20);
  struct stat status{};
  ASSERT_EQ(::stat(path().c_str(), &status), 0);
  EXPECT_GE(status.st_blocks * 512, 1 << 20);
}

TEST_F(MemoryFileTest, IsForOwnerAndGroupWhateverTheUmask) {
  const mode_t before = ::umask(0777);
  const auto sut = MemoryFile::create(name_.get(), 1);
  ::umask(before);
  ASSERT_TRUE(sut);
  struct stat status{};
  ASSERT_EQ(::stat(path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0660U);
}

TEST_F(MemoryFileTest, CreateRefusesATakenName) {
  const auto first = MemoryFile::create(name_.get(), 1);
  EXPECT_EQ(MemoryFile::create(name_.get(), 1).error().code, ErrorCode::already_exists);
}

TEST_F(MemoryFileTest, ReplaceLeavesOldUsersTheirMapping) {
  const auto old = MemoryFile::replace(name_.get(), 100);
  ASSERT_TRUE(old);
  old->bytes()[0] = std::byte{1};
  const auto fresh = MemoryFile::replace(name_.get(), 200);
  ASSERT_TRUE(fresh);
  EXPECT_EQ(old->bytes()[0], std::byte{1});
  EXPECT_EQ(fresh->bytes()[0], std::byte{0});
  EXPECT_EQ(MemoryFile::open(name_.get(), 1, Access::read_only)->bytes().size(), 200U);
}

TEST_F(MemoryFileTest, HasNoNameBeforeItIsFilledAndNoneIfThatFails) {
  const auto sut = MemoryFile::create(name_.get(), 1, [&](std::span<std::byte>) -> Result<void> {
    EXPECT_FALSE(std::filesystem::exists(path()));
    return failure(ErrorCode::wrong_state, "no");
  });
  EXPECT_EQ(sut.error().code, ErrorCode::wrong_state);
  EXPECT_FALSE(std::filesystem::exists(path()));
}

TEST_F(MemoryFileTest, OpenSeesTheSameMemory) {
  const auto made = MemoryFile::create(name_.get(), 100);
  const auto sut = MemoryFile::open(name_.get(), 100, Access::read_write);
  ASSERT_TRUE(made && sut);
  sut->bytes()[99] = std::byte{7};
  EXPECT_EQ(made->bytes()[99], std::byte{7});
}

TEST_F(MemoryFileTest, OpenFailsWhenThereIsNone) {
  EXPECT_EQ(MemoryFile::open(name_.get(), 1, Access::read_only).error().code, ErrorCode::not_found);
}

TEST_F(MemoryFileTest, OpenFailsWhenItIsTooSmall) {
  const auto made = MemoryFile::create(name_.get(), 100);
  const auto sut = MemoryFile::open(name_.get(), 101, Access::read_only);
  EXPECT_EQ(sut.error().code, ErrorCode::corrupt);
  EXPECT_THAT(sut.error().message, HasSubstr("100 bytes, at least 101"));
}

TEST_F(MemoryFileTest, OpenDoesNotFollowALinkNorWaitAtAFifo) {
  std::filesystem::create_symlink("/dev/zero", path());
  EXPECT_FALSE(MemoryFile::open(name_.get(), 0, Access::read_write));
  MemoryFile::remove(name_.get());
  ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
  EXPECT_EQ(MemoryFile::open(name_.get(), 0, Access::read_only).error().code, ErrorCode::wrong_type);
}

TEST_F(MemoryFileTest, SaysThatThereIsNoRoom) {
  const auto sut = MemoryFile::create(name_.get(), std::size_t{1} << 45);
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, ErrorCode::full);
  EXPECT_THAT(sut.error().describe(), HasSubstr("/dev/shm has no room"));
  EXPECT_FALSE(std::filesystem::exists(path()));
}

TEST_F(MemoryFileTest, RefusesNamesThatLeadElsewhere) {
  for (const std::string name : {"", ".", "..", "a/b", "../x", "/x"}) {
    EXPECT_EQ(MemoryFile::create(name, 1).error().code, ErrorCode::invalid_argument) << name;
    EXPECT_EQ(MemoryFile::open(name, 1, Access::read_only).error().code, ErrorCode::invalid_argument) << name;
    MemoryFile::remove(name);
  }
}

TEST_F(MemoryFileTest, RefusesSizeZero) {
  EXPECT_EQ(MemoryFile::create(name_.get(), 0).error().code, ErrorCode::invalid_argument);
}

TEST_F(MemoryFileTest, MovesItsMapping) {
  auto first = MemoryFile::create(name_.get(), 1);
  auto second = MemoryFile::replace(name_.get(), 2);
  ASSERT_TRUE(first && second);
  const MemoryFile third = std::move(*second);
  EXPECT_FALSE(*second);
  EXPECT_EQ(third.bytes().size(), 2U);
  *first = MemoryFile::open(name_.get(), 1, MemoryFile::Access::read_write).value();
  EXPECT_EQ(first->bytes().size(), 2U);
  first->bytes()[1] = std::byte{1};
}

}  // namespace
}  // namespace plchost
