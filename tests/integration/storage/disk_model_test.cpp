// Ways to write a file that a power cut breaks: each of them is found, and the right one is not.
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"
#include "shm/files/replace_file.hpp"
#include "tests/integration/storage/recorded_folder.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class PowerCut : public RecordedFolder {
 protected:
  /// Without any sync but those that are asked for.
  void write(const std::string& name, const std::string& text, bool synced, int flags = O_TRUNC) const {
    const UniqueFd fd(::open(path(name).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, 0600));
    ASSERT_EQ(::write(fd.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
    if (synced) {
      ASSERT_EQ(::fsync(fd.get()), 0);
    }
  }
  void rename(const std::string& from, const std::string& to) const { fs::rename(path(from), path(to)); }
  void sync() const { ASSERT_TRUE(sync_directory(top())); }
  /// The old contents, which are on the disk.
  void begin() {
    ASSERT_TRUE(replace_file(path("file.plain"), "old"));
    sync();
    mark("kept all");
  }
};

TEST_F(PowerCut, BreaksNoFileThatIsReplacedAsItShouldBe) {
  begin();
  for (const char* const text : {"new", "newer"}) {
    ASSERT_TRUE(replace_file(path("file.plain"), text));
    sync();
    mark("kept all");
  }
  EXPECT_THAT(problems(FileSystem::ordered), IsEmpty());
  EXPECT_THAT(problems(FileSystem::weak), IsEmpty());
  EXPECT_GT(states(), 10U);
}

TEST_F(PowerCut, BreaksAFileThatIsRenamedBeforeItsBytesAreSynced) {
  begin();
  write("file.plain.new", "new", false);
  rename("file.plain.new", "file.plain");
  sync();
  EXPECT_THAT(problems(FileSystem::ordered), Contains(HasSubstr("0 bytes where 3 bytes")));
  EXPECT_THAT(problems(FileSystem::weak), Not(IsEmpty()));
}

TEST_F(PowerCut, TakesBackARenameWhoseFolderIsNotSynced) {
  begin();
  ASSERT_TRUE(replace_file(path("file.plain"), "new"));
  mark("kept all");
  EXPECT_THAT(problems(FileSystem::ordered), Contains(HasSubstr("mark 'kept all'")));
  EXPECT_THAT(problems(FileSystem::weak), Not(IsEmpty()));
}

TEST_F(PowerCut, BreaksAFileThatIsEmptiedAndWrittenInPlace) {
  begin();
  write("file.plain", std::string(9000, 'n'), true);
  mark("kept all");
  // A file that is empty for a moment was seen so by processes, too: a torn one never was.
  EXPECT_THAT(problems(FileSystem::ordered), Contains(HasSubstr("4096 bytes where")));
  EXPECT_THAT(problems(FileSystem::weak), Contains(HasSubstr("512 bytes where")));
}

TEST_F(PowerCut, LeavesZerosAndHolesInAFileThatGrows) {
  begin();
  write("file.plain", std::string(9000, 'n'), false, O_APPEND);
  EXPECT_THAT(problems(FileSystem::ordered), Not(IsEmpty()));
  const std::string zeros = "old" + std::string(9000, '\0');
  bool found = false;
  model().for_each_cut(FileSystem::weak, [&](const CutDisk& disk) {
    const auto file = disk.files.find(path("file.plain"));
    found = found || (file != disk.files.end() && *file->second == zeros);
  });
  EXPECT_TRUE(found);
}

TEST_F(PowerCut, TakesAWholeFolderWhoseNameWasNotSynced) {
  fs::create_directory(path("folder"));
  write("folder/file.plain", "new", true);
  ASSERT_TRUE(sync_directory(path("folder")));
  mark("kept all");
  EXPECT_THAT(problems(FileSystem::ordered), IsEmpty()) << "a sync takes the names before it along";
  EXPECT_THAT(problems(FileSystem::weak), Contains(HasSubstr("no file where 3 bytes")));
}

TEST_F(PowerCut, BreaksNothingInANewFolderWhoseNameIsSynced) {
  ASSERT_TRUE(make_synced_folders(path("a/b/c"), 0700));
  ASSERT_TRUE(replace_file(path("a/b/c/file.plain"), "new"));
  ASSERT_TRUE(sync_directory(path("a/b/c")));
  mark("kept all");
  EXPECT_THAT(problems(FileSystem::weak), IsEmpty());
  EXPECT_EQ(fs::status(path("a/b/c")).permissions(), fs::perms::owner_all);
}

TEST_F(PowerCut, KeepsWhatAProcessLeftUnsyncedThatWasKilledAfterItMadeAFolder) {
  fs::create_directory(path("folder"));
  ASSERT_TRUE(make_synced_folders(path("folder"), 0700));
  ASSERT_TRUE(replace_file(path("folder/file.plain"), "new"));
  ASSERT_TRUE(sync_directory(path("folder")));
  mark("kept all");
  EXPECT_THAT(problems(FileSystem::weak), IsEmpty());
}

TEST_F(PowerCut, OfAFileThatNoRuleIsKnownForIsAProblem) {
  write("file.strange", "new", true);
  EXPECT_THAT(problems(FileSystem::ordered), Contains(HasSubstr("no rule is known for this file")));
}

TEST_F(PowerCut, IsNotLookedAtWhereAChangeIsNotRecorded) {
  fs::create_symlink("nowhere", path("link"));
  EXPECT_THAT(read_model().error().message, HasSubstr("nothing recorded leads there"));
}

TEST_F(PowerCut, IsRecordedAsTheFolderReallyIs) {
  begin();
  fs::copy_file(path("file.plain"), path("copy.plain"));
  std::ofstream(path("stream.plain")) << "by a stream";
  std::ofstream(path("stream.plain"), std::ios::app) << ", and more";
  fs::resize_file(path("copy.plain"), 2);
  fs::create_hard_link(path("copy.plain"), path("link.plain"));
  fs::remove(path("file.plain"));
  fs::create_directories(path("a/b"));
  fs::remove_all(path("a"));
  std::FILE* const file = std::fopen(path("c.plain").c_str(), "we");
  ASSERT_EQ(std::fclose(file), 0);
  expect_real_folder();
}

}  // namespace
}  // namespace plchost
