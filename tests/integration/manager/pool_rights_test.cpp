#include "manager/pool_rights.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/files/memory_file.hpp"
#include "tests/integration/manager/plant.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

constexpr mode_t kPermissions = 07777;

struct stat status_of(const Plant& plant) {
  struct stat status{};
  EXPECT_EQ(::stat(fmt::format("{}/{}", MemoryFile::kDirectory, plant.pool()).c_str(), &status), 0);
  return status;
}

// One that this process may give files to: any for root, else its own.
gid_t some_group() {
  constexpr gid_t kAnother = 1;
  return ::geteuid() == 0 ? kAnother : ::getegid();
}

TEST(PoolRights, AreThoseOfTheConfigurationWhateverTheUmaskSays) {
  const mode_t before = ::umask(0077);
  Plant plant;
  plant.set_host_keys(fmt::format("pool_group = \"{}\"\npool_mode = \"0664\"", some_group()));
  plant.start_manager();
  ::umask(before);
  EXPECT_EQ(status_of(plant).st_mode & kPermissions, 0664U);
  EXPECT_EQ(status_of(plant).st_gid, some_group());
  EXPECT_EQ(status_of(plant).st_uid, ::geteuid());
}

TEST(PoolRights, OfAPoolThatIsThereAlreadyAreRenewedAndThatIsSaid) {
  Plant plant;
  plant.start_manager();
  EXPECT_EQ(status_of(plant).st_mode & kPermissions, 0660U);
  plant.kill_manager();
  plant.set_host_keys("pool_mode = \"0600\"");
  plant.start_manager();
  EXPECT_EQ(status_of(plant).st_mode & kPermissions, 0600U);
  EXPECT_THAT(plant.log(), HasSubstr("mode 0600 now"));
}

TEST(PoolRights, OfAPoolThatAStrangerMadeBeforeAreNotTaken) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to give a file to another user";
  constexpr uid_t kNobody = 65534;
  const std::string name = own_name("rights");
  const auto made = MemoryFile::create(name, 100, {}, {.owner = kNobody});
  ASSERT_TRUE(made);
  const auto refused = check_pool_owner(name, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("belongs to user 65534"));
  EXPECT_TRUE(check_pool_owner(name, {.owner = kNobody}));
  MemoryFile::remove(name);
  EXPECT_TRUE(check_pool_owner(name, {})) << "there is none";
}

}  // namespace
}  // namespace plchost
