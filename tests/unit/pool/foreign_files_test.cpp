// Files of other users under a host's names in /dev/shm are neither used nor in the way.
#include "shm/pages/foreign_files.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/files/pool_files.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/transition_ring.hpp"
#include "shm/plc_process_image.h"
#include "shm/pool/object_pool.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Access = MemoryFile::Access;

constexpr uid_t kStranger = 65534;

class ForeignFiles : public testing::Test {
 protected:
  ForeignFiles() {
    if (::geteuid() != 0) skip_ = true;
  }
  ~ForeignFiles() override {
    for (const auto& at : fs::directory_iterator(MemoryFile::kDirectory)) {
      const std::string file = at.path().filename();
      if (file.starts_with(pool_.get())) fs::remove_all(at.path());
    }
  }
  void SetUp() override {
    if (skip_) GTEST_SKIP() << "to give files to another user needs root";
  }
  static void give_away(const std::string& file) {
    ASSERT_EQ(::lchown(MemoryFile::path(file).c_str(), kStranger, kStranger), 0);
  }
  /// A file of a stranger that everybody may write.
  static void plant_file(const std::string& file) {
    std::ofstream(MemoryFile::path(file)) << std::string(100, 'x');
    ::chmod(MemoryFile::path(file).c_str(), 0666);
    give_away(file);
  }
  static bool exists(const std::string& file) {
    return fs::exists(fs::symlink_status(MemoryFile::path(file)));
  }
  [[nodiscard]] std::vector<ForeignFile> take_away() const {
    return take_away_foreign_files(pool_.get(), {.mode = 0660});
  }

  UniquePoolName pool_;
  bool skip_ = false;
};

TEST_F(ForeignFiles, OfAnotherUserAreNotOpenedThoughTheirModeAllowsIt) {
  ASSERT_TRUE(MemoryFile::create(pool_.get(), 100));
  ASSERT_TRUE(MemoryFile::open(pool_.get(), 1, Access::read_only));
  give_away(pool_.get());
  const auto refused = MemoryFile::open(pool_.get(), 1, Access::read_only);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::refused);
  EXPECT_THAT(refused.error().message, HasSubstr("owner 65534"));
  EXPECT_EQ(MemoryFile::fill_empty(pool_.get(), 1).error().code, ErrorCode::refused);
  EXPECT_TRUE(MemoryFile::open(pool_.get(), 1, Access::read_only, is_any_owner));
}

TEST_F(ForeignFiles, OfTwoNamesAreNotOpened) {
  const std::string other = pool_.get() + ".other";
  ASSERT_TRUE(MemoryFile::create(pool_.get(), 100));
  fs::create_hard_link(MemoryFile::path(pool_.get()), MemoryFile::path(other));
  EXPECT_EQ(MemoryFile::open(other, 1, Access::read_write).error().code, ErrorCode::refused);
}

TEST_F(ForeignFiles, AreReplacedWhateverTheyAre) {
  const std::string path = MemoryFile::path(pool_.get());
  const auto expect_replaced = [&](const char* what) {
    const auto made = MemoryFile::replace(pool_.get(), 10);
    EXPECT_TRUE(made) << what << ": " << made.error().describe();
    EXPECT_TRUE(MemoryFile::open(pool_.get(), 10, Access::read_write)) << what;
    fs::remove_all(path);
  };
  plant_file(pool_.get());
  expect_replaced("file");
  fs::create_directory(path);
  expect_replaced("folder");
  fs::create_directory(path);
  std::ofstream(path + "/trap") << "x";
  struct stat status{};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  expect_replaced("folder with something in it");
  const std::string aside = MemoryFile::path(".put-aside." + std::to_string(status.st_ino));
  EXPECT_TRUE(fs::exists(aside + "/trap")) << "the contents of a stranger's folder are not touched";
  fs::remove_all(aside);
  ASSERT_EQ(::mkfifo(path.c_str(), 0666), 0);
  expect_replaced("FIFO");
  fs::create_symlink("/etc/passwd", path);
  expect_replaced("link");
}

TEST_F(ForeignFiles, UnderAnyNameOfTheHostAreTakenAwayAndToldAndOthersStay) {
  const std::string& pool = pool_.get();
  plant_file(pool);
  fs::create_directory(MemoryFile::path(host_page_name(pool)));
  ASSERT_EQ(::mkfifo(MemoryFile::path(transition_ring_name(pool, "line1")).c_str(), 0666), 0);
  fs::create_symlink("/dev/zero", MemoryFile::path(instance_page_name(pool, "line1")));
  plant_file(instance_claim_name(pool, "line1"));
  plant_file(pool + ".posts");
  plant_file(pool + ".wish.line1");
  plant_file(pool + ".variables.line1");
  plant_file(pool + ".recorder.line1");
  plant_file(pool_memory_name(pool, "line1.retain"));
  plant_file(pool_memory_name(pool, "image"));
  const std::string others = pool + "-another.host";
  plant_file(others);
  ASSERT_TRUE(MemoryFile::create(instance_page_name(pool, "line2"), 10)) << "ours";
  const auto found = take_away();
  EXPECT_THAT(found, SizeIs(11));
  for (const ForeignFile& file : found) {
    EXPECT_TRUE(file.taken_away) << file.taken_away.error().describe();
    EXPECT_FALSE(fs::exists(fs::symlink_status(file.path))) << file.path;
    if (file.path.ends_with(".retain")) {
      EXPECT_EQ(file.rights, "owner 65534, group 65534, mode 0666");
    }
  }
  EXPECT_TRUE(exists(others));
  EXPECT_TRUE(exists(instance_page_name(pool, "line2")));
  EXPECT_THAT(take_away(), IsEmpty());
}

TEST_F(ForeignFiles, OfThoseWhoMayWriteThePoolStayButNotAsRetainVariables) {
  plant_file(pool_memory_name(pool_.get(), "image"));
  plant_file(pool_memory_name(pool_.get(), "line1.retain"));
  const auto found = take_away_foreign_files(pool_.get(), {.mode = 0666});
  EXPECT_THAT(found, SizeIs(1));
  EXPECT_TRUE(exists(pool_memory_name(pool_.get(), "image")));
  EXPECT_FALSE(exists(pool_memory_name(pool_.get(), "line1.retain")));
  EXPECT_THAT(take_away_foreign_files(pool_.get(), {.group = kStranger, .mode = 0660}), IsEmpty())
      << "its group is the pool's";
  EXPECT_THAT(take_away(), SizeIs(1));
}

TEST_F(ForeignFiles, OfAnApiServerOfThatUserAreItsOwn) {
  plant_file(pool_.get() + ".posts");
  plant_file(pool_.get() + ".download.1");
  plant_file(host_page_name(pool_.get()));
  EXPECT_THAT(take_away_foreign_files(pool_.get(), {.mode = 0660}, kStranger), SizeIs(1));
  EXPECT_FALSE(exists(host_page_name(pool_.get())));
  EXPECT_TRUE(exists(pool_.get() + ".posts"));
  EXPECT_THAT(take_away(), SizeIs(2)) << "it has the manager's user";
}

// Instances are in the group of the server. They have no part in its ledger, nor in what it receives.
TEST_F(ForeignFiles, OfAnInstancesUserAreNoneOfTheServer) {
  constexpr uid_t kOfInstances = 64045;
  ASSERT_TRUE(trust_instances_of(kOfInstances));
  const auto own = [&](const std::string& name) {
    plant_file(name);
    EXPECT_EQ(::chown(MemoryFile::path(name).c_str(), kOfInstances, kOfInstances), 0);
  };
  own(pool_.get() + ".posts");
  own(pool_.get() + ".download.1");
  own(instance_page_name(pool_.get(), "line1"));
  EXPECT_THAT(take_away_foreign_files(pool_.get(), {.mode = 0660}, kStranger), SizeIs(2));
  EXPECT_TRUE(exists(instance_page_name(pool_.get(), "line1")));
}

TEST_F(ForeignFiles, OfRootsGroupAreGivenToTheManagers) {
  ASSERT_TRUE(HostPageWriter::create(pool_.get()));
  plant_file(pool_.get() + ".posts");
  const std::string neighbour = pool_.get() + "2.host";
  std::ofstream(MemoryFile::path(neighbour)) << "page";
  const auto group = [](const std::string& file) {
    struct stat status{};
    EXPECT_EQ(::stat(MemoryFile::path(file).c_str(), &status), 0);
    return status.st_gid;
  };
  constexpr gid_t kManagers = 64041;
  give_roots_files(pool_.get(), kManagers);
  EXPECT_EQ(group(host_page_name(pool_.get())), kManagers);
  EXPECT_EQ(group(pool_.get() + ".posts"), kStranger);
  EXPECT_EQ(group(neighbour), 0U);
}

TEST_F(ForeignFiles, APoolOfAnotherUserIsNotGoneOnWith) {
  ASSERT_TRUE(ObjectPool::create(pool_.get(), {.max_objects = 16}));
  give_away(pool_.get());
  const auto refused = ObjectPool::create(pool_.get(), {.max_objects = 16});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::refused);
  EXPECT_TRUE(ObjectPool::create(pool_.get(), {.max_objects = 16, .rights = {.owner = kStranger}}));
  EXPECT_TRUE(ObjectPool::attach(pool_.get())) << "a client uses what there is";
}

TEST_F(ForeignFiles, APageOfAnotherUserIsMadeAnew) {
  ASSERT_TRUE(HostPageWriter::create(pool_.get()));
  give_away(host_page_name(pool_.get()));
  EXPECT_FALSE(HostPageReader::open(pool_.get()));
  ASSERT_TRUE(HostPageWriter::create(pool_.get()));
  EXPECT_TRUE(HostPageReader::open(pool_.get()));
  ASSERT_TRUE(TransitionRing::open(pool_.get(), "line1"));
  give_away(transition_ring_name(pool_.get(), "line1"));
  EXPECT_FALSE(TransitionRingReader::open(pool_.get(), "line1"));
  ASSERT_TRUE(TransitionRing::open(pool_.get(), "line1"));
  EXPECT_TRUE(TransitionRingReader::open(pool_.get(), "line1"));
}

// The object is there, its file was removed, and a stranger has put another one in its place.
TEST_F(ForeignFiles, AMemoryInWhosePlaceAStrangerHasPutAnotherOneIsMadeAnew) {
  auto pool = ObjectPool::create(pool_.get(), {.max_objects = 16}).value();
  ASSERT_TRUE(pool.create_memory("image", 100, {.keep = true}));
  const std::string file = pool_memory_name(pool_.get(), "image");
  fs::remove(MemoryFile::path(file));
  plant_file(file);
  EXPECT_FALSE(pool.open_memory("image"));
  const auto made = pool.create_memory("image", 100, {.keep = true});
  ASSERT_TRUE(made) << made.error().describe();
  EXPECT_EQ(made->object.bytes()[0], std::byte{0});
}

// Made by firmware of the pool's group, so it is welcome, also in the place of one of another user's.
TEST_F(ForeignFiles, AnImageOfFirmwareInThePlaceOfAnotherUsersIsTaken) {
  auto pool = ObjectPool::create(pool_.get(), {.max_objects = 16, .rights = {.mode = 0666}}).value();
  plc_image image{};
  ASSERT_EQ(plc_image_open(pool_.get().c_str(), "in", 64, PLC_IMAGE_WRITE, &image), 0);
  ASSERT_TRUE(pool.open_memory("in"));
  give_away(pool_memory_name(pool_.get(), "in"));
  const auto again = pool.open_memory("in");
  EXPECT_TRUE(again) << again.error().describe();
  plc_image_close(&image);
}

}  // namespace
}  // namespace plchost
