#include "shm/files/lock_file.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class LockFileTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directory(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  /// The code of what another process gets.
  [[nodiscard]] ErrorCode taken_by_another() const {
    const pid_t child = ::fork();
    if (child == 0) {
      const auto lock = LockFile::take(path_);
      ::_exit(lock ? 0 : static_cast<int>(lock.error().code));
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return static_cast<ErrorCode>(WEXITSTATUS(status));
  }

  std::string folder_ = own_path("lock");
  std::string path_ = folder_ + "/lock";
};

TEST_F(LockFileTest, IsHeldByOneProcessUntilItLetsGo) {
  {
    const auto sut = LockFile::take(path_);
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_EQ(taken_by_another(), ErrorCode::already_exists);
  }
  EXPECT_EQ(taken_by_another(), ErrorCode::ok);
}

TEST_F(LockFileTest, SaysWhoHoldsItAndIsFreeWhenThatOneIsKilled) {
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const pid_t holder = ::fork();
  if (holder == 0) {
    const auto lock = LockFile::take(path_);
    (void)!::write(ready[1], "x", 1);
    for (;;) ::pause();
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  const auto refused = LockFile::take(path_);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr(fmt::format("process {} holds", holder)));
  ::kill(holder, SIGKILL);
  ::waitpid(holder, nullptr, 0);
  EXPECT_TRUE(LockFile::take(path_));
  ::close(ready[0]);
  ::close(ready[1]);
}

// A process that an application starts by fork() outlives it, and does not keep the name taken.
TEST_F(LockFileTest, IsNotHeldByChildrenOfItsHolder) {
  pid_t child = 0;
  {
    const auto sut = LockFile::take(path_);
    ASSERT_TRUE(sut);
    child = ::fork();
    if (child == 0) {
      for (;;) ::pause();
    }
  }
  EXPECT_EQ(taken_by_another(), ErrorCode::ok);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

TEST_F(LockFileTest, IsTakenAnewAfterItsHolderHasRemovedIt) {
  auto first = LockFile::take(path_);
  ASSERT_TRUE(first);
  first->remove();
  EXPECT_EQ(taken_by_another(), ErrorCode::ok);
}

TEST_F(LockFileTest, IsRefusedIfOthersCanWriteItOrItIsNoFile) {
  const auto expect_refused = [&](const char* what) {
    const auto refused = LockFile::take(path_);
    ASSERT_FALSE(refused) << what;
    EXPECT_EQ(refused.error().code, ErrorCode::refused) << what << ": " << refused.error().describe();
    std::filesystem::remove_all(path_);
  };
  std::ofstream(path_) << "";
  ::chmod(path_.c_str(), 0666);
  expect_refused("of all");
  std::filesystem::create_directory(path_);
  expect_refused("folder");
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  expect_refused("FIFO");
  std::filesystem::create_symlink("/dev/null", path_);
  expect_refused("link");
  if (::geteuid() != 0) return;
  std::ofstream(path_) << "";
  ASSERT_EQ(::chown(path_.c_str(), 65534, 65534), 0);
  expect_refused("of another user");
}

}  // namespace
}  // namespace plchost
