// The folder of `plcctl security`, cut at every change that it makes.
#include "api/security/identity.hpp"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/security/security_folder.hpp"
#include "tests/integration/storage/recorded_folder.hpp"

namespace plchost::security {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

class IdentitiesUnderPowerCuts : public RecordedFolder {
 protected:
  ~IdentitiesUnderPowerCuts() override { fs::remove_all(cut_); }
  [[nodiscard]] SecurityFolder open() const { return SecurityFolder::open(plant_).value(); }
  /// Of the identity, in each state from the first mark on. A process that was killed leaves one of them,
  /// too.
  std::vector<std::string> faults(const std::string& name, FileSystem file_system) {
    const std::string folder = file_in(plant_, name);
    DiskChecks checks(model(), top(), cut_);
    std::set<std::vector<const void*>> seen;
    std::vector<std::string> found;
    model().for_each_cut(file_system, [&](const CutDisk& disk) {
      if (model().promised(folder, disk.cut) == 0) return;
      std::vector<const void*> contents;
      for (auto at = disk.files.lower_bound(folder); at != disk.files.end() && at->first.starts_with(folder);
           ++at)
        contents.push_back(at->second.get());
      if (!seen.insert(contents).second) return;
      checks.put(disk.files);
      const std::string put = checks.folder() + folder.substr(top().size());
      std::error_code missing;  // rights are not recorded
      fs::permissions(file_in(put, kKeyFile), fs::perms::owner_read | fs::perms::owner_write, missing);
      const auto checked = check_identity(put);
      if (!checked) found.push_back(checked.error().describe() + "; " + disk.told);
    });
    EXPECT_GT(seen.size(), 1U);
    return found;
  }

  std::string plant_ = path("plant");
  std::string cut_ = own_path("cut");
};

TEST_F(IdentitiesUnderPowerCuts, AreRenewedInOneStep) {
  ASSERT_TRUE(SecurityFolder::init(plant_, "cell"));
  ASSERT_TRUE(open().add(Role::operating, "anna"));
  mark("kept all");
  ASSERT_TRUE(open().renew("anna"));
  ASSERT_TRUE(open().renew("cell"));
  mark("kept all");
  expect_real_folder();
  for (const FileSystem file_system : {FileSystem::ordered, FileSystem::weak}) {
    EXPECT_THAT(faults("anna", file_system), IsEmpty());
    EXPECT_THAT(faults("cell", file_system), IsEmpty());
  }
}

}  // namespace
}  // namespace plchost::security
