// plchostd --check-config finds what a start would find.
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include "tests/integration/manager/plant.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class CheckConfig : public testing::Test {
 protected:
  CheckConfig() { std::filesystem::create_directories(folder_); }
  ~CheckConfig() override { std::filesystem::remove_all(folder_); }
  CheckConfig(const CheckConfig&) = delete;
  CheckConfig& operator=(const CheckConfig&) = delete;

  // Its output, with its exit code at the end.
  std::string check(const std::string& text) {
    write("cell.toml", fmt::format("[host]\nname = \"cell1\"\nrun_directory = \"{0}/run\"\n"
                                   "state_directory = \"{0}/state\"\n{1}",
                                   folder_.native(), text));
    const std::string command =
        fmt::format("cd {} && {}/bin/plchostd --check-config cell.toml 2>&1; echo exit $?", folder_.native(),
                    PLCHOST_BUILD_DIRECTORY);
    std::FILE* const output = ::popen(command.c_str(), "r");
    std::string all;
    std::array<char, 256> part{};
    while (std::fgets(part.data(), part.size(), output) != nullptr) all += part.data();
    ::pclose(output);
    return all;
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  static std::string instance(const std::string& keys) {
    return "[[instance]]\nname = \"line1\"\ncore = 0\n" + keys;
  }
  static std::string application(const std::string& name) {
    return fmt::format("application = \"{}\"\n", Plant::application(name));
  }

  std::filesystem::path folder_ = own_path("check");
};

TEST_F(CheckConfig, SaysThatAllIsWell) {
  write("line1.cfg", "[CmpSchedule]\nSchedulerInterval=1000\n");
  EXPECT_EQ(check(instance(application("bottling_line") + "settings = \"line1.cfg\"\n")),
            "cell.toml: ok, 1 instance\nexit 0\n");
}

TEST_F(CheckConfig, TriesTheApplication) {
  const std::string output = check(instance(application("fault_crashes")));
  EXPECT_THAT(output, HasSubstr("cell.toml:8: [[instance]] 'line1' application: "));
  EXPECT_THAT(output, HasSubstr("it crashes in its set-up: SIGSEGV in open_valve"));
  EXPECT_THAT(output, HasSubstr("exit 1"));
}

TEST_F(CheckConfig, ReadsTheSettings) {
  write("line1.cfg", "[CmpSchedule]\nSchedulerInterval=soon\n");
  const std::string output = check(instance(application("bottling_line") + "settings = \"line1.cfg\"\n"));
  EXPECT_THAT(output, HasSubstr("cell.toml:9: [[instance]] 'line1' settings: "));
  EXPECT_THAT(output, HasSubstr("line1.cfg:2: [CmpSchedule] SchedulerInterval: 'soon' is not allowed"));
}

TEST_F(CheckConfig, TriesTheApplicationWithItsSettings) {
  write("line1.cfg", "[Task.Nobody]\nDrivesOutputs=1\n");
  const std::string output = check(instance(application("bottling_line") + "settings = \"line1.cfg\"\n"));
  EXPECT_THAT(output, HasSubstr("cell.toml:8: [[instance]] 'line1' application: "));
  EXPECT_THAT(output, HasSubstr("Nobody"));
}

TEST_F(CheckConfig, KnowsTheInterfacesOfTheHost) {
  const std::string output = check("[dds]\ninterface = \"none0\"\nallow_unsecured = true\n");
  EXPECT_THAT(output, HasSubstr("cell.toml:6: [dds] interface: there is no interface 'none0'; there are "));
  EXPECT_THAT(output, HasSubstr("lo"));
}

// As the start says it.
TEST_F(CheckConfig, KnowsWhoseTheFoldersOfTheHostAre) {
  for (const char* const kind :
       {"", "/wishes.cell1", "/audit.cell1", "/applications.cell1", "/exceptions.cell1"}) {
    const auto folder = folder_ / ("state" + std::string(kind));
    std::filesystem::create_directories(folder);
    std::filesystem::permissions(folder, std::filesystem::perms::all);
    const std::string output = check("");
    EXPECT_THAT(output, HasSubstr("cell.toml:4: [host] state_directory: " + folder.native() + " (owner"));
    EXPECT_THAT(output, HasSubstr("other users can put files into it"));
    EXPECT_THAT(output, HasSubstr("exit 1"));
    std::filesystem::remove(folder);
  }
  EXPECT_EQ(check(""), "cell.toml: ok, 0 instances\nexit 0\n");
}

// A start runs with each of them, keeps nothing, and says so.
TEST_F(CheckConfig, FindsWhatIsNoFolderOfTheHost) {
  namespace fs = std::filesystem;
  const auto state = folder_ / "state";
  const auto expect = [&](const fs::path& path, const std::string& why) {
    EXPECT_EQ(check(""),
              fmt::format("cell.toml:4: [host] state_directory: {} {}: a start would run, and keep "
                          "nothing there; mend that, or name another folder\nexit 1\n",
                          path.native(), why));
    fs::remove(path);
  };
  write("state", "");
  EXPECT_THAT(check(""), HasSubstr("[host] state_directory: " + state.native() + " is not a folder\nexit 1"));
  fs::remove(state);
  fs::create_symlink("state", state);
  expect(state, "cannot be used: Too many levels of symbolic links");
  fs::create_symlink("nothing", state);
  expect(state, "is a link to something that is not there");
  for (const char* const kind : {"wishes.cell1", "audit.cell1", "applications.cell1", "exceptions.cell1"}) {
    fs::create_directory(state);
    write(std::string("state/") + kind, "");
    expect(state / kind, "is not a folder");
    fs::create_symlink("nothing", state / kind);
    expect(state / kind, "is a link to something that is not there");
    fs::remove(state);
  }
  EXPECT_EQ(check(""), "cell.toml: ok, 0 instances\nexit 0\n");
}

// The one that checks is not always the one that starts.
TEST_F(CheckConfig, SaysWhoseStartItIsAbout) {
  constexpr uid_t kNobody = 65534;
  const auto state = folder_ / "state";
  std::filesystem::create_directory(state);
  if (::chown(state.c_str(), kNobody, kNobody) != 0) return;  // only root can give it away
  EXPECT_THAT(check(""), HasSubstr("This is about a start by user 0; if user 65534 is to start the manager, "
                                   "check as that one\nexit 1"));
}

}  // namespace
}  // namespace plchost
