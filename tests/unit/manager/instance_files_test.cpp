// Folders and files of instances that have a user of their own.
#include "manager/supervisor/instance_files.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include "shm/files/lock_file.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pages/instance_page.hpp"
#include "tests/support/can_enter.hpp"
#include "tests/support/in_a_child.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;

constexpr uid_t kUser = 64043;  // of no account
const UserAccount kAccount{.number = kUser, .group = kUser, .groups = {kUser}};

class InstanceFiles : public testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root has instances of another user";
    folder_ = own_path("instance-files");
    fs::create_directories(folder_);
    left_ = {.instance = "line1", .pool = own_name("pool"), .run_directory = folder_};
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
    MemoryFile::remove(instance_page_name(left_.pool, "line1"));
  }
  [[nodiscard]] std::string write(const std::string& name, uid_t owner,
                                  std::string_view text = "text") const {
    const fs::path path = folder_ / name;
    std::ofstream(path) << text;
    fs::permissions(path, fs::perms(0640));
    EXPECT_EQ(::chown(path.c_str(), owner, ::getegid()), 0);
    return path;
  }
  /// Owner, mode and text; empty: it is not there.
  [[nodiscard]] std::string look(const std::string& name) const {
    struct stat status{};
    const fs::path path = folder_ / name;
    if (::lstat(path.c_str(), &status) != 0) return "";
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return fmt::format("{} {:04o} {}", status.st_uid, status.st_mode & 07777U, text.str());
  }
  [[nodiscard]] std::string rights_of_folder() const {
    struct stat status{};
    EXPECT_EQ(::stat(folder_.c_str(), &status), 0);
    return fmt::format("{} {} {:04o}", status.st_uid, status.st_gid, status.st_mode & 07777U);
  }
  /// A user of this process's group makes a file in the folder.
  [[nodiscard]] std::string made_by(uid_t user) const {
    return in_a_child([&] {
      if (::setgroups(0, nullptr) != 0 || ::setresuid(user, user, user) != 0) return std::string("no user");
      const bool made = std::ofstream(folder_ / "planted").good();
      (void)::unlink((folder_ / "planted").c_str());
      return std::string(made ? "made it" : "made nothing");
    });
  }
  fs::path folder_;
  LeftFiles left_;
};

TEST_F(InstanceFiles, LieInAFolderInWhichEachUserHasTheOwnOnes) {
  const fs::path above = folder_.parent_path();
  ASSERT_TRUE(can_enter(above, kUser)) << "other users may not enter " << above << ", or a folder above it";
  ASSERT_TRUE(share_with_instances(folder_, {&kUser, 1}));
  EXPECT_EQ(rights_of_folder(), fmt::format("0 {} 1771", ::getegid()));
  const std::string managers = write("manager.lock", 0);
  EXPECT_EQ(in_a_child([&] {
              const gid_t group = kUser;  // beside the manager's, which instances have
              if (::setgroups(1, &group) != 0 || ::setresuid(kUser, kUser, kUser) != 0)
                return std::string("no user");
              const bool made = std::ofstream(folder_ / "line1.sock").good();
              return fmt::format("{} {}", made, ::unlink(managers.c_str()) == 0);
            }),
            "true false");
  const bool has_list = ::getxattr(folder_.c_str(), "system.posix_acl_access", nullptr, 0) > 0;
  EXPECT_EQ(made_by(kUser + 1), has_list ? "made nothing" : "made it") << "it is in the manager's group";
  ASSERT_TRUE(share_with_instances(folder_, {}));
  EXPECT_EQ(rights_of_folder(), fmt::format("0 {} 0755", ::getegid()));
  EXPECT_EQ(made_by(kUser), "made nothing");
}

TEST_F(InstanceFiles, OfTheManagerAloneKeepItsRights) {
  fs::permissions(folder_, fs::perms(0750));
  ASSERT_TRUE(share_with_instances(folder_, {}));
  EXPECT_EQ(rights_of_folder(), fmt::format("0 {} 0750", ::getegid()));
}

TEST_F(InstanceFiles, WithContentsAreHandedOverBothWays) {
  for (const char* name : {"line1.exception", "line1.settings", "line1.events"}) (void)write(name, 0);
  for (const char* name : {"line1.claim", "line1.sock"}) (void)write(name, 0);
  (void)write("line2.exception", 0);
  ASSERT_TRUE(share_with_instances(folder_, {&kUser, 1}));
  hand_over_files(left_, kAccount);
  const std::string theirs = fmt::format("{} 0640 text", kUser);
  for (const char* name : {"line1.exception", "line1.settings", "line1.events"})
    EXPECT_EQ(look(name), theirs);
  for (const char* name : {"line1.claim", "line1.sock"}) EXPECT_EQ(look(name), "");
  EXPECT_EQ(look("line2.exception"), "0 0640 text");
  hand_over_files(left_, std::nullopt);
  EXPECT_EQ(look("line1.exception"), "0 0640 text");
}

TEST_F(InstanceFiles, OfRetainVariablesAreHandedOver) {
  for (const char* name : {"line1.retain.0", "line1.retain.1", "line1.retain.lock", "line1.retain.0.new"})
    (void)write(name, 0);
  ASSERT_TRUE(share_with_instances(folder_, {&kUser, 1}));
  hand_over_retain_files(folder_, "line1", kAccount);
  EXPECT_EQ(look("line1.retain.0"), fmt::format("{} 0640 text", kUser));
  EXPECT_EQ(look("line1.retain.1"), fmt::format("{} 0640 text", kUser));
  EXPECT_EQ(look("line1.retain.lock"), "");
  EXPECT_EQ(look("line1.retain.0.new"), "");
}

TEST_F(InstanceFiles, OfRetainVariablesInMemoryAreHandedOverBothWays) {
  const std::string memory = pool_memory_name(left_.pool, "line1.retain");
  const fs::path path = MemoryFile::path(memory);
  constexpr gid_t kPools = 64041;
  const auto fill = [](std::span<std::byte> bytes) -> Result<void> {
    std::ranges::fill(bytes, std::byte{7});
    return {};
  };
  ASSERT_TRUE(MemoryFile::create(memory, 64, fill, {.group = kPools, .mode = 0660}));
  const std::string text(64, '\7');
  const auto shown = [&](uid_t owner) { return fmt::format("{} 0660 {}", owner, text); };
  ASSERT_TRUE(trust_instances_of(kUser));
  hand_over_files(left_, kAccount);
  EXPECT_EQ(look(path), shown(kUser));
  struct stat status{};
  EXPECT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_gid, kPools) << "firmware of that group uses it";
  hand_over_files(left_, std::nullopt);
  EXPECT_EQ(look(path), shown(0));
  EXPECT_FALSE(fs::exists(path.string() + ".new"));
  MemoryFile::remove(memory);
}

// Anybody may make files in /dev/shm, and a PLC would begin with these values.
TEST_F(InstanceFiles, OfRetainVariablesInMemoryAreNotThoseOfAStranger) {
  constexpr uid_t kStranger = 64099;
  const std::string memory = pool_memory_name(left_.pool, "line1.retain");
  const fs::path path = MemoryFile::path(memory);
  std::ofstream(path) << "planted";
  ASSERT_EQ(::chown(path.c_str(), kStranger, kStranger), 0);
  fs::permissions(path, fs::perms(0666));
  hand_over_files(left_, kAccount);
  EXPECT_FALSE(fs::exists(path));
  fs::create_directory(path.string() + ".new");
  std::ofstream(path) << "the manager's";
  fs::permissions(path, fs::perms(0640));
  hand_over_files(left_, kAccount);
  EXPECT_EQ(look(path), fmt::format("{} 0640 the manager's", kUser)) << "nothing is in the way";
  MemoryFile::remove(memory);
}

// That user can put links into the folder, and the manager is root.
TEST_F(InstanceFiles, AreNoneThatALinkLeadsTo) {
  const std::string secret = write("secret", 0, "secret");
  ASSERT_TRUE(share_with_instances(folder_, {&kUser, 1}));
  fs::create_symlink(secret, folder_ / "line1.exception");
  fs::create_hard_link(secret, folder_ / "line1.events");
  hand_over_files(left_, kAccount);
  EXPECT_EQ(look("secret"), "0 0640 secret");
  EXPECT_TRUE(fs::is_symlink(folder_ / "line1.exception"));
  EXPECT_EQ(look("line1.events"), "0 0640 secret") << "nobody else has it";
}

TEST_F(InstanceFiles, StayWhileAProcessHasTheName) {
  const std::string claim = write("line1.claim", 0);
  fs::permissions(claim, fs::perms(0600));
  const std::string socket = write("line1.sock", 0);
  const std::string done = in_a_child([&] {
    const auto held = LockFile::take(claim);
    if (!held) return held.error().describe();
    // A lock does not hold for the own process.
    return in_a_child([&] {
      hand_over_files(left_, kAccount);
      return std::string("done");
    });
  });
  EXPECT_EQ(done, "done");
  EXPECT_EQ(look("line1.claim"), "0 0600 text");
  EXPECT_EQ(look("line1.sock"), "0 0640 text");
}

TEST_F(InstanceFiles, OfAPageOfAnotherUserMakeRoom) {
  const std::string page = instance_page_name(left_.pool, "line1");
  ASSERT_TRUE(MemoryFile::create(page, 64));
  hand_over_files(left_, std::nullopt);
  EXPECT_TRUE(fs::exists(MemoryFile::path(page))) << "it is the own one";
  hand_over_files(left_, kAccount);
  EXPECT_FALSE(fs::exists(MemoryFile::path(page)));
}

TEST_F(InstanceFiles, OfTheManagerGetThePlaceOfAFolder) {
  fs::create_directories(folder_ / "manager.sock" / "inner");
  put_folder_aside(folder_ / "manager.sock");
  EXPECT_FALSE(fs::exists(folder_ / "manager.sock"));
  const std::string file = write("manager.lock", 0);
  put_folder_aside(file);
  EXPECT_EQ(look("manager.lock"), "0 0640 text");
}

TEST_F(InstanceFiles, TellWhichUsersTheyHaveHad) {
  (void)write("line1.claim", kUser);
  (void)write("line2.claim", kUser);
  (void)write("line3.claim", 0);
  (void)write("line4.sock", 64044);
  EXPECT_THAT(users_in(folder_), testing::ElementsAre(kUser));
  EXPECT_THAT(users_in(folder_, Claims::held), testing::IsEmpty()) << "no process has a claim";
}

}  // namespace
}  // namespace plchost
