// Folders that the manager gives to the group of an API server with a user of its own.
#include "manager/server_files.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/files/memory_file.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;

class ServerFiles : public testing::Test {
 protected:
  ServerFiles() : root_(own_path("server-files")), folder_(root_ / "state" / "audit.cell") {
    fs::create_directories(root_);
  }
  ~ServerFiles() override { fs::remove_all(root_); }
  static std::string mode(const fs::path& path) {
    return fmt::format("{:04o}", static_cast<unsigned>(fs::symlink_status(path).permissions()));
  }
  static void write(const fs::path& path, fs::perms rights = fs::perms::owner_read) {
    std::ofstream(path) << "text";
    fs::permissions(path, rights);
  }
  fs::path root_;
  fs::path folder_;
};

TEST_F(ServerFiles, AreMadeWithTheFoldersAbove) {
  ASSERT_TRUE(share_folder(folder_, GroupRight::writes));
  EXPECT_EQ(mode(folder_), "0770");
  ASSERT_TRUE(share_folder(root_ / "state" / "applications.cell", GroupRight::reads));
  EXPECT_EQ(mode(root_ / "state" / "applications.cell"), "0750");
}

TEST_F(ServerFiles, OfAVersionBeforeAreGivenToTheGroup) {
  fs::create_directories(folder_ / "line1");
  fs::permissions(folder_, fs::perms::owner_all);
  write(folder_ / "line1" / "000001.json");
  ASSERT_TRUE(share_folder(folder_, GroupRight::reads));
  EXPECT_EQ(mode(folder_ / "line1"), "0750");
  EXPECT_EQ(mode(folder_ / "line1" / "000001.json"), "0640");
  ASSERT_TRUE(share_folder(folder_, GroupRight::writes));
  EXPECT_EQ(mode(folder_ / "line1" / "000001.json"), "0660");
}

TEST_F(ServerFiles, ThatAreKeptAreForNobodyElse) {
  fs::create_directories(folder_.parent_path());
  ASSERT_TRUE(keep_folder(folder_));
  EXPECT_EQ(mode(folder_), "0700");
  ASSERT_TRUE(share_folder(folder_, GroupRight::writes));
  ASSERT_TRUE(keep_folder(folder_));
  EXPECT_EQ(mode(folder_), "0700");
}

// The server writes there, and the manager is root.
TEST_F(ServerFiles, AreNoneThatALinkLeadsTo) {
  fs::create_directories(folder_);
  fs::create_directories(root_ / "other");
  write(root_ / "other" / "secret");
  fs::permissions(root_ / "other", fs::perms::owner_all);
  fs::create_symlink(root_ / "other" / "secret", folder_ / "link");
  fs::create_symlink(root_ / "other", folder_ / "refused");
  fs::create_hard_link(root_ / "other" / "secret", folder_ / "name");
  ASSERT_TRUE(share_folder(folder_, GroupRight::writes));
  EXPECT_EQ(mode(root_ / "other" / "secret"), "0400");
  EXPECT_EQ(mode(root_ / "other"), "0700");
  EXPECT_FALSE(share_folder(folder_ / "refused", GroupRight::writes));
  EXPECT_EQ(mode(root_ / "other"), "0700");
}

TEST_F(ServerFiles, OfOtherUsersStayAsTheyAre) {
  if (::geteuid() != 0) GTEST_SKIP() << "to give files to another user needs root";
  fs::create_directories(folder_);
  write(folder_ / "theirs");
  ASSERT_EQ(::chown((folder_ / "theirs").c_str(), 65534, 65534), 0);
  ASSERT_TRUE(share_folder(folder_, GroupRight::writes));
  EXPECT_EQ(mode(folder_ / "theirs"), "0400");
}

// How far each source of posts has come.
TEST_F(ServerFiles, OfTheLedgerAreGivenToTheUserOfTheServer) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root has a server of another user";
  constexpr uid_t kServer = 64042;
  const UserAccount account{.number = kServer, .group = kServer, .groups = {kServer}};
  const std::string pool = own_name("pool");
  const fs::path ledger = MemoryFile::path(pool + ".posts");
  const auto owner_and_text = [&] {
    struct stat status{};
    if (::lstat(ledger.c_str(), &status) != 0) return std::string();
    std::ostringstream text;
    text << std::ifstream(ledger).rdbuf();
    return fmt::format("{} {}", status.st_uid, text.str());
  };
  write(ledger, fs::perms(0600));
  hand_over_ledger(pool, account);
  EXPECT_EQ(owner_and_text(), "64042 text");
  hand_over_ledger(pool, std::nullopt);
  EXPECT_EQ(owner_and_text(), "") << "of a user that the server does not have";
  write(ledger, fs::perms(0600));
  ASSERT_EQ(::chown(ledger.c_str(), kServer + 1, kServer + 1), 0);
  hand_over_ledger(pool, account);
  EXPECT_EQ(owner_and_text(), "") << "an instance may have put it there";
}

}  // namespace
}  // namespace plchost
