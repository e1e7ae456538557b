#include "shm/files/replace_file.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

class ReplaceFile : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directory(directory); }
  void TearDown() override { std::filesystem::remove_all(directory); }

  [[nodiscard]] std::string contents() const {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  std::string directory = own_path("replace");
  std::string path = directory + "/kept";
};

TEST_F(ReplaceFile, MakesAndReplacesAndLeavesNothingBeside) {
  ASSERT_TRUE(replace_file(path, "a long first text\n"));
  ASSERT_TRUE(replace_file(path, "second\n"));
  EXPECT_EQ(contents(), "second\n");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory), {}), 1);
}

TEST_F(ReplaceFile, ASecretIsItsOwnersOnlyWhateverWasLeftBefore) {
  std::ofstream(path + ".new") << "left";
  std::ofstream(path) << "read by all";
  ASSERT_TRUE(replace_file(path, "secret", 0600));
  EXPECT_EQ(std::filesystem::status(path).permissions(), std::filesystem::perms(0600));
  EXPECT_EQ(contents(), "secret");
}

TEST_F(ReplaceFile, WhatCannotBeWrittenLeavesTheOldContents) {
  ASSERT_TRUE(replace_file(path, "kept"));
  std::filesystem::create_directory(path + ".new");
  const auto replaced = replace_file(path, "lost");
  ASSERT_FALSE(replaced);
  EXPECT_NE(replaced.error().describe().find(path + ".new"), std::string::npos);
  EXPECT_EQ(contents(), "kept");
}

TEST_F(ReplaceFile, WhatCannotBePutInItsPlaceLeavesNothingBeside) {
  std::filesystem::create_directory(path);
  EXPECT_FALSE(replace_file(path, "lost"));
  EXPECT_TRUE(std::filesystem::is_directory(path));
  EXPECT_FALSE(std::filesystem::exists(path + ".new"));
}

TEST_F(ReplaceFile, FoldersAreMadeWithTheirRightsAndThoseThatAreThereStayAsTheyAre) {
  namespace fs = std::filesystem;
  ASSERT_TRUE(make_synced_folders(directory + "/a/b/", 0700));
  EXPECT_EQ(fs::status(directory + "/a/b").permissions(), fs::perms::owner_all);
  ASSERT_TRUE(make_synced_folders(directory + "/a/b", 0750));
  EXPECT_EQ(fs::status(directory + "/a/b").permissions(), fs::perms::owner_all);
  ASSERT_TRUE(make_synced_folder(directory + "/a/c", 0700));
  const auto without_parent = make_synced_folder(directory + "/d/e", 0700);
  ASSERT_FALSE(without_parent);
  EXPECT_EQ(without_parent.error().describe(),
            "cannot create folder " + directory + "/d/e: No such file or directory (ENOENT)");
}

TEST_F(ReplaceFile, AFolderThatIsThereMayLieInOneThatCannotBeSynced) {
  const auto there = make_synced_folder("/proc/self", 0700);
  EXPECT_TRUE(there) << there.error().describe();
}

}  // namespace
}  // namespace plchost
