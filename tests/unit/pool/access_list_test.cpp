// Users that have rights to a file beside its owner and its group.
#include "shm/files/access_list.hpp"

#include <array>
#include <filesystem>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_file.hpp"
#include "tests/support/in_a_child.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

constexpr uid_t kFirstUser = 64043;  // of no account
constexpr uid_t kSecondUser = 64044;
constexpr gid_t kGroup = 64041;

class AccessList : public testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can be other users";
    path_ = MemoryFile::path(own_name("list"));
    file_.reset(::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
    ASSERT_TRUE(file_);
    ASSERT_EQ(::fchown(file_.get(), 0, kGroup), 0);
    if (const auto lists = let({&kFirstUser, 1}, 6, 0640);
        !lists && lists.error().code == ErrorCode::unsupported)
      GTEST_SKIP() << lists.error().describe();
  }
  void TearDown() override {
    if (!path_.empty()) std::filesystem::remove(path_);
  }
  [[nodiscard]] Result<void> let(std::span<const uid_t> users, mode_t rights, mode_t mode) const {
    return let_users(file_.get(), users, rights, mode, path_);
  }
  /// "rw", "r" or nothing: the rights of a user of that group.
  [[nodiscard]] std::string may(uid_t user, gid_t group) const {
    return in_a_child([&] {
      if (::setgroups(0, nullptr) != 0 || ::setresgid(group, group, group) != 0 ||
          ::setresuid(user, user, user) != 0)
        return std::string("no user");
      return fmt::format("{}{}", ::access(path_.c_str(), R_OK) == 0 ? "r" : "",
                         ::access(path_.c_str(), W_OK) == 0 ? "w" : "");
    });
  }
  [[nodiscard]] mode_t mode() const {
    struct stat status{};
    EXPECT_EQ(::fstat(file_.get(), &status), 0);
    return status.st_mode & 07777U;
  }
  std::string path_;
  UniqueFd file_;
};

TEST_F(AccessList, GivesUsersMoreThanTheGroupHas) {
  ASSERT_TRUE(let({&kFirstUser, 1}, 6, 0640));
  EXPECT_EQ(may(kFirstUser, kFirstUser), "rw");
  EXPECT_EQ(may(kSecondUser, kGroup), "r");
  EXPECT_EQ(may(kSecondUser, kSecondUser), "");
  EXPECT_EQ(mode(), 0660U) << "the rights of users and group together";
}

TEST_F(AccessList, HasTheUsersOfTheLastCall) {
  const std::array both{kSecondUser, kFirstUser, kSecondUser};
  ASSERT_TRUE(let(both, 6, 0640));
  EXPECT_EQ(may(kFirstUser, kFirstUser), "rw");
  EXPECT_EQ(may(kSecondUser, kSecondUser), "rw");
  ASSERT_TRUE(let({&kSecondUser, 1}, 4, 0600));
  EXPECT_EQ(may(kFirstUser, kFirstUser), "");
  EXPECT_EQ(may(kSecondUser, kSecondUser), "r");
  ASSERT_TRUE(let({}, 0, 0640));
  EXPECT_EQ(may(kSecondUser, kSecondUser), "");
  EXPECT_EQ(may(kSecondUser, kGroup), "r");
  EXPECT_EQ(mode(), 0640U);
}

// As systemd does with the folders of a service at each start.
TEST_F(AccessList, IsWholeAgainAfterTheBitsWereChanged) {
  ASSERT_TRUE(let({&kFirstUser, 1}, 6, 0640));
  ASSERT_EQ(::fchmod(file_.get(), 0644), 0);
  EXPECT_EQ(may(kFirstUser, kFirstUser), "r");
  ASSERT_TRUE(let({&kFirstUser, 1}, 6, 0640));
  EXPECT_EQ(may(kFirstUser, kFirstUser), "rw");
  EXPECT_EQ(may(kSecondUser, kSecondUser), "");
}

TEST_F(AccessList, IsTheOwnersToGive) {
  EXPECT_EQ(in_a_child([&] {
              if (::setresuid(kFirstUser, kFirstUser, kFirstUser) != 0) return std::string("no user");
              const auto done = let({&kSecondUser, 1}, 6, 0640);
              return done ? std::string("done") : std::string(to_string(done.error().code));
            }),
            to_string(ErrorCode::refused));
}

}  // namespace
}  // namespace plchost
