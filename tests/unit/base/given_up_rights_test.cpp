// Rights that a process gives up are gone: capabilities, and files.
#include <filesystem>
#include <fstream>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"
#include "shm/process/capabilities.hpp"
#include "shm/process/file_view.hpp"
#include "tests/support/in_a_child.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

std::string capabilities_of_this() {
  std::ifstream status("/proc/self/status");
  std::string text;
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("CapEff") || line.starts_with("CapPrm")) text += line.substr(8) + " ";
  }
  return text;
}

TEST(GivenUpRights, OfCapabilitiesTheOthersStay) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root has capabilities";
  EXPECT_EQ(in_a_child([] {
              if (!give_up_all_capabilities()) return std::string("refused");
              return capabilities_of_this();
            }),
            "0000000000000000 0000000000000000 ");
  const std::string left = in_a_child([] {
    if (!give_up_capabilities({CAP_SETGID, CAP_SETUID})) return std::string("refused");
    constexpr uid_t kNobody = 65534;
    return fmt::format("{} {}", ::syscall(SYS_setresuid, kNobody, kNobody, kNobody),
                       ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && never_gains_rights());
  });
  EXPECT_EQ(left, "-1 true");
  EXPECT_NE(in_a_child([] {
              if (!give_up_capabilities({CAP_SETGID})) return std::string("refused");
              return capabilities_of_this();
            }),
            "0000000000000000 0000000000000000 ");
}

class FileViews : public testing::Test {
 protected:
  FileViews() : folder_(own_path("view")) {
    for (const char* name : {"read", "write", "hidden"}) {
      std::filesystem::create_directories(folder_ / name);
      std::ofstream(folder_ / name / "file") << "text";
    }
  }
  ~FileViews() override { std::filesystem::remove_all(folder_); }
  void SetUp() override {
    if (in_a_child([] { return restricted({}); }).contains("Landlock")) GTEST_SKIP() << "no Landlock here";
  }
  static std::string restricted(const FileView& view) {
    (void)::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    const auto done = restrict_files(view);
    return done ? "" : done.error().describe();
  }
  /// Whether a file can be read, written and made in the folder of that name.
  [[nodiscard]] std::string can_in(const std::string& name) const {
    const auto opens = [&](const char* file, int flags) {
      return static_cast<bool>(UniqueFd(::open((folder_ / name / file).c_str(), flags, 0600)));
    };
    return fmt::format("{} {} {}", opens("file", O_RDONLY), opens("file", O_WRONLY | O_TRUNC),
                       opens("made", O_WRONLY | O_CREAT));
  }
  [[nodiscard]] std::string sees(const std::string& name) const {
    return in_a_child([&] {
      const std::string wrong =
          restricted({.read = {(folder_ / "read").string(), (folder_ / "nowhere").string()},
                      .write = {(folder_ / "write").string()}});
      return wrong.empty() ? can_in(name) : wrong;
    });
  }
  std::filesystem::path folder_;
};

TEST_F(FileViews, AreAllThatAProcessOpens) {
  EXPECT_EQ(sees("read"), "true false false");
  EXPECT_EQ(sees("hidden"), "false false false");
  EXPECT_EQ(sees("write"), "true true true");
}

TEST_F(FileViews, MayBeSingleFiles) {
  EXPECT_EQ(in_a_child([&] {
              (void)restricted({.read = {(folder_ / "read" / "file").string()}, .write = {}});
              return can_in("read");
            }),
            "true false false");
}

}  // namespace
}  // namespace plchost
