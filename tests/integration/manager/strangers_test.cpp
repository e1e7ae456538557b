// Other users of the machine have put things under the names of a host before its manager starts.
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pages/transition_ring.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/integration/manager/plant.hpp"

namespace plchost {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr uid_t kStranger = 65534;

class StrangersFiles : public testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "to give files to another user needs root";
  }
  static void give_away(const std::string& file) {
    ASSERT_EQ(::lchown(MemoryFile::path(file).c_str(), kStranger, kStranger), 0);
  }
  static void plant_file(const std::string& file) {
    std::ofstream(MemoryFile::path(file)) << std::string(5000, 'x');
    ::chmod(MemoryFile::path(file).c_str(), 0666);
    give_away(file);
  }
  /// From now on.
  bool says_products(const std::string& products) {
    const std::size_t before = plant.log().size();
    return Plant::eventually(
        [&] { return plant.log().find("products " + products + ", ", before) != std::string::npos; });
  }

  Plant plant;
};

TEST_F(StrangersFiles, AreReplacedToldAndKeepNothingFromRunning) {
  plant.add("line1", "bottling_line");
  const std::string& pool = plant.pool();
  plant_file(pool);
  fs::create_directory(MemoryFile::path(host_page_name(pool)));
  give_away(host_page_name(pool));
  ASSERT_EQ(::mkfifo(MemoryFile::path(transition_ring_name(pool, "line1")).c_str(), 0666), 0);
  give_away(transition_ring_name(pool, "line1"));
  fs::create_symlink("/etc/passwd", MemoryFile::path(instance_page_name(pool, "line1")));
  give_away(instance_page_name(pool, "line1"));
  plant_file(instance_claim_name(pool, "line1"));
  plant_file(pool_memory_name(pool, "blocks"));
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running)) << plant.log();
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
  for (const std::string& file :
       {pool, host_page_name(pool), transition_ring_name(pool, "line1"), instance_page_name(pool, "line1")}) {
    EXPECT_THAT(plant.log(),
                HasSubstr(MemoryFile::path(file) + " was put there by another user (owner 65534, "));
    struct stat status{};
    ASSERT_EQ(::lstat(MemoryFile::path(file).c_str(), &status), 0) << file;
    EXPECT_TRUE(S_ISREG(status.st_mode)) << file;
    EXPECT_EQ(status.st_uid, ::geteuid()) << file;
  }
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), IsEmpty());
}

TEST_F(StrangersFiles, WithWholeRetainValuesBecomeNoValues) {
  plant.add("packer1", "packer");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log();
  {
    const auto pool = ObjectPool::attach(plant.pool()).value();
    auto event = pool.open_event("packer1/product").value();
    for (int i = 0; i < 24; ++i) (void)event.post();
  }
  ASSERT_TRUE(says_products("24")) << plant.log();
  // A stranger's copy of them is as good as any that he makes himself.
  const std::string kept = MemoryFile::path(pool_memory_name(plant.pool(), retain_memory_name("packer1")));
  const std::string copy = MemoryFile::path(plant.pool() + "-copy");
  fs::copy_file(kept, copy);
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  fs::remove_all(plant.state_directory());
  fs::rename(copy, kept);
  give_away(pool_memory_name(plant.pool(), retain_memory_name("packer1")));
  ::chmod(kept.c_str(), 0666);
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running)) << plant.log();
  EXPECT_TRUE(says_products("0")) << plant.log();
  EXPECT_THAT(plant.log(), HasSubstr(kept + " was put there by another user (owner 65534, "));
}

TEST_F(StrangersFiles, ARunDirectoryThatOthersCanWriteIsRefused) {
  plant.start_manager();
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  ::chmod(plant.run_directory().c_str(), 0777);
  EXPECT_THAT(plant.start_refused_manager(), HasSubstr("other users can put files into it"));
  ::chmod(plant.run_directory().c_str(), 0755);
  ASSERT_EQ(::chown(plant.run_directory().c_str(), kStranger, kStranger), 0);
  EXPECT_THAT(plant.start_refused_manager(), HasSubstr("owner 65534"));
}

// Applications in it are run by the manager's user.
TEST_F(StrangersFiles, AStateDirectoryThatOthersCanWriteIsRefused) {
  plant.start_manager();
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  const fs::path state = plant.state_directory();
  ::chmod(state.c_str(), 0777);
  EXPECT_THAT(plant.start_refused_manager(),
              AllOf(HasSubstr("[host] state_directory"), HasSubstr("other users can put files into it")));
  ::chmod(state.c_str(), 0755);
  for (const fs::path& folder : {state, state / "applications.cell", state / "wishes.cell"}) {
    fs::create_directories(folder);
    ASSERT_EQ(::chown(folder.c_str(), kStranger, kStranger), 0);
    EXPECT_THAT(plant.start_refused_manager(), HasSubstr(folder.string() + " (owner 65534, "));
    ASSERT_EQ(::chown(folder.c_str(), 0, 0), 0);
  }
  plant.start_manager();
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
}

// The name that an instance was once claimed by, which anybody on the host can take.
TEST_F(StrangersFiles, NorAnAbstractSocketOfTheInstancesNameKeepItFromRunning) {
  plant.add("line1", "bottling_line");
  const UniqueFd taken(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = "plchost/" + plant.pool() + "/line1";
  name.copy(std::begin(address.sun_path) + 1, name.size());
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  ASSERT_EQ(::bind(taken.get(), reinterpret_cast<const sockaddr*>(&address), size), 0);
  plant.start_manager();
  EXPECT_TRUE(plant.wait_for("line1", InstanceState::running)) << plant.log();
}

}  // namespace
}  // namespace plchost
