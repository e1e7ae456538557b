#include "manager/system/disk_thread.hpp"

#include <fstream>

#include "tests/unit/manager/wish_store_fixture.hpp"

namespace plchost {
namespace {

constexpr Duration kPatience = std::chrono::seconds(30);

TEST(DiskThreadTest, GivesTheAnswersInTheirOrder) {
  DiskThread sut;
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(sut.ask<int>(std::chrono::seconds(20), "disk", [i] { return 2 * i; }).value(), 2 * i);
  }
}

TEST(DiskThreadTest, WaitsForADiskThatHangsOnceAndBeginsNothingThatWasGivenUp) {
  DiskThread sut;
  bool begun = false;
  {
    const FrozenDisk frozen(sut);
    const auto later = sut.within(std::chrono::milliseconds(10), "later", [&] { begun = true; });
    ASSERT_FALSE(later);
    EXPECT_EQ(later.error().code, ErrorCode::timed_out);
  }
  EXPECT_EQ(sut.ask<int>(std::chrono::seconds(20), "disk", [] { return 7; }).value(), 7);
  EXPECT_FALSE(begun);
}

/// In a folder of its own.
class WishFolderTest : public testing::Test {
 protected:
  WishFolderTest() {
    top_ = own_path("wishes");
    std::filesystem::create_directories(top_);
  }
  ~WishFolderTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(top_, ignored);
  }
  WishFolderTest(const WishFolderTest&) = delete;
  WishFolderTest& operator=(const WishFolderTest&) = delete;

  [[nodiscard]] std::string folder() const { return wishes_folder(top_.string() + "/state", "cell"); }

  std::filesystem::path top_;
  DiskThread disk_;
  WishFolderLock sut_;
};

TEST_F(WishFolderTest, IsMadeAndHeld) {
  const auto taken = sut_.take(disk_, folder(), kPatience);
  ASSERT_TRUE(taken) << taken.error().describe();
  EXPECT_EQ(std::filesystem::status(folder()).permissions(), std::filesystem::perms::owner_all);
  const auto child = ::fork();
  if (child == 0) {  // another process
    WishFolderLock other;
    DiskThread disk;
    const auto refused = other.take(disk, folder(), kPatience);
    const bool good =
        !refused && refused.error().code == ErrorCode::already_exists &&
        refused.error().message.find(folder()) != std::string::npos &&
        refused.error().message.find(fmt::format("process {} ", ::getppid())) != std::string::npos;
    ::_exit(good ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

TEST_F(WishFolderTest, ThatCannotBeMadeIsNoOtherManager) {
  std::ofstream(top_ / "state") << "in the way";
  const auto taken = sut_.take(disk_, folder());
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::system);
}

TEST_F(WishFolderTest, WithAnotherUsersLockFileIsNoOtherManager) {
  std::filesystem::create_directories(folder());
  std::filesystem::create_symlink("/etc/passwd", folder() + "/manager.lock");
  const auto taken = sut_.take(disk_, folder());
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::refused);
}

TEST_F(WishFolderTest, OnADiskThatHangsIsWaitedForNoLongerThanTheLimit) {
  const auto disk = std::make_shared<std::promise<void>>();
  const auto answer = disk->get_future().share();
  const auto taken =
      sut_.take(disk_, folder(), std::chrono::milliseconds(50), [disk, answer](const std::string& path) {
        answer.wait();
        return LockFile::take(path);
      });
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::timed_out);
  disk->set_value();
}

}  // namespace
}  // namespace plchost
