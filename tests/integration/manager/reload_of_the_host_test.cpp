// Keys of the host that are changed while instances run.
#include <csignal>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "manager/config/config_changes.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/threads/thread.hpp"
#include "tests/integration/manager/reload_fixture.hpp"
#include "tests/support/sanitized.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

// In place of plchost-dds: says who it is and what it was started with.
constexpr const char* kToldServer = "echo \"$$ $*\" >> api.log\nexec sleep 1000\n";

/// A line of the configuration in place of another one; `before` may be the end of a line.
struct Edit {
  std::string before;
  std::string now;
};

class ReloadOfTheHost : public Reload {
 protected:
  void start_served() {
    plant_.use_api_server(kToldServer);
    start();
    ASSERT_TRUE(Plant::eventually([&] { return servers().size() == 1; }));
  }
  std::vector<std::string> servers() { return plant_.lines_of("api.log"); }
  ControlReply reload_with(const Edit& edit) {
    std::string text = plant_.configuration();
    const std::size_t at = text.find(edit.before);
    EXPECT_NE(at, std::string::npos) << edit.before;
    plant_.write_configuration(text.replace(at, edit.before.size(), edit.now));
    return plant_.ask(ControlVerb::reload_host, "");
  }
  static std::string line(std::string_view key) {
    for (const ConfigKey& known : all_config_keys()) {
      if (key == fmt::format("{} {}", known.section, known.name)) {
        return change_text(key, describe(known.when), known.why);
      }
    }
    return "no such key";
  }
};

TEST_F(ReloadOfTheHost, StartsTheApiServerAnewForItsKeysAndNothingElse) {
  start_served();
  struct Key {
    std::string name;
    Edit edit;
    std::string option;
  };
  const std::vector<Key> keys = {
      {"[host] labels", {"[dds]\n", "labels = [\"hall2\"]\n[dds]\n"}, "--label hall2"},
      {"[host] dds_domain", {"[dds]\n", "dds_domain = 9\n[dds]\n"}, "--domain 9"},
      {"[host] application_limit_mib",
       {"[dds]\n", "application_limit_mib = 7\n[dds]\n"},
       "--application-limit 7"},
      {"[dds] peers", {"[dds]\n", "[dds]\npeers = [\"127.0.0.9\"]\n"}, "--peer 127.0.0.9"},
      {"[dds] multicast", {"[dds]\n", "[dds]\nmulticast = false\n"}, "--no-multicast"},
      {"[dds] allow_unsecured", {"[dds]\n", "[dds]\nallow_unsecured = true\n"}, "--allow-unsecured"},
      {"[dds] user", {"[dds]\n", "[dds]\nuser = \"65534\"\n"}, "--user 65534"},
      {"[blocks] host_number", {"[dds]\n", "[blocks]\nhost_number = 7\n[dds]\n"}, "--host-number 7"},
      {"[blocks] base", {"[dds]\n", "[blocks]\nbase = \"belt\"\n[dds]\n"}, "--blocks-base belt"},
  };
  std::size_t started = 1;
  for (const Key& key : keys) {
    EXPECT_THAT(reload_with(key.edit).text, HasSubstr(line(key.name)));
    ++started;
    ASSERT_TRUE(Plant::eventually([&] { return servers().size() == started; })) << key.name;
    EXPECT_THAT(servers().back(), HasSubstr(key.option));
  }
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  expect_nothing_left();
}

TEST_F(ReloadOfTheHost, StartsAndEndsTheApiServerAsTheFileSays) {
  start_served();
  const int server = std::stoi(servers().back());
  EXPECT_EQ(reload_with({"enabled = true", "enabled = false"}).text,
            "[dds] enabled changed, used at once; plchost-dds ends");
  EXPECT_TRUE(Plant::eventually([&] { return !open_process(server); }));
  EXPECT_EQ(servers().size(), 1U);
  EXPECT_EQ(reload_with({"enabled = true", "enabled = true"}).text, line("[dds] enabled"));
  EXPECT_TRUE(Plant::eventually([&] { return servers().size() == 2; }));
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

// A server that is ended before its answer has reached the client would have the client ask once more.
TEST_F(ReloadOfTheHost, EndsTheApiServerWhenCommandsAreAnsweredOnly) {
  if (kSanitized) GTEST_SKIP() << "a reload may take longer than the command that it waits for";
  plant_.use_api_server(kToldServer);
  plant_.add("slow", "bottling_line");
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("slow", InstanceState::running));
  ASSERT_TRUE(Plant::eventually([&] { return servers().size() == 1; }));
  auto process = open_process(plant_.status("slow").pid);
  ASSERT_TRUE(process);
  ASSERT_TRUE(signal_process(*process, SIGSTOP));
  auto link = plant_.connect();
  ASSERT_TRUE(link.send(encode(ControlRequest{
      .number = 1, .verb = ControlVerb::reset_statistics, .instance = "slow", .argument = ""})));
  EXPECT_EQ(reload_with({"[dds]\n", "[dds]\nmulticast = false\n"}).text, line("[dds] multicast"));
  bool answered = false;
  const auto anew_before_the_answer = [&] {
    const bool anew = servers().size() > 1;  // looked at first
    answered = answered || link.receive().value_or(std::nullopt).has_value();
    return anew && !answered;
  };
  EXPECT_FALSE(Plant::within(std::chrono::seconds(1), anew_before_the_answer));
  ASSERT_TRUE(signal_process(*process, SIGCONT));
  EXPECT_TRUE(Plant::eventually([&] {
    EXPECT_FALSE(anew_before_the_answer());
    return answered;
  }));
  EXPECT_TRUE(Plant::eventually([&] { return servers().size() == 2; }));
  expect_nothing_left();
}

TEST_F(ReloadOfTheHost, NamesEachKeyThatWaitsAndForWhat) {
  if (kSanitized) GTEST_SKIP() << "ten reloads may take longer than a server has to come up";
  start_served();
  const std::string run = plant_.run_directory();
  const std::string state = plant_.state_directory();
  const std::vector<std::pair<std::string, Edit>> keys = {
      {"[host] name", {"name = \"cell\"", "name = \"hall\""}},
      {"[host] run_directory", {run, run + "2"}},
      {"[host] state_directory", {state, state + "2"}},
      {"[host] pool", {plant_.pool() + "\"", plant_.pool() + "2\""}},
      {"[host] pool_objects", {"[dds]\n", "pool_objects = 5000\n[dds]\n"}},
  };
  for (const auto& [key, edit] : keys) {
    EXPECT_EQ(reload_with(edit).text, line(key));
    EXPECT_EQ(reload_with(edit).text, line(key)) << "it waits still";
  }
  EXPECT_EQ(servers().size(), 1U);
  EXPECT_FALSE(std::filesystem::exists(run + "2"));
  EXPECT_FALSE(std::filesystem::exists(state + "2"));
  EXPECT_FALSE(HostPageReader::open(plant_.pool() + "2"));
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  expect_nothing_left();
}

TEST_F(ReloadOfTheHost, GivesThePoolOtherRightsAtOnce) {
  start();
  EXPECT_EQ(reload_with({"[dds]\n", "pool_mode = \"0600\"\n[dds]\n"}).text, line("[host] pool_mode"));
  struct stat status{};
  ASSERT_EQ(::stat(MemoryFile::path(plant_.pool()).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

TEST_F(ReloadOfTheHost, LeavesThePoolAtTheEndIfTheFileSaysSoNow) {
  start();
  EXPECT_EQ(reload_with({"[dds]\n", "keep_pool = true\n[dds]\n"}).text, line("[host] keep_pool"));
  EXPECT_EQ(plant_.stop_manager().describe(), "exit code 0");
  EXPECT_TRUE(std::filesystem::exists(MemoryFile::path(plant_.pool())));
}

TEST_F(ReloadOfTheHost, MovesTheManagerAndItsServerToOtherCoresAtOnce) {
  const auto online = online_cores();
  if (!online || online->size() < 2) GTEST_SKIP() << "one core only";
  start_served();
  const int core = online->back();
  const std::string keys = fmt::format("housekeeping_cores = [{}]\n[dds]\n", core);
  EXPECT_EQ(reload_with({"[dds]\n", keys}).text, line("[host] housekeeping_cores"));
  EXPECT_EQ(cores_of_process(plant_.manager_pid()), std::vector{core});
  EXPECT_EQ(cores_of_process(std::stoi(servers().back())), std::vector{core});
  EXPECT_EQ(servers().size(), 1U);
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

// Each process says in its log what it was asked for, at the level info.
TEST_F(ReloadOfTheHost, ChangesTheLogLevelOfAllProcessesAtOnce) {
  start();
  EXPECT_EQ(reload_with({"[dds]\n", "log_level = \"error\"\n[dds]\n"}).text,
            "[host] log_level changed, used at once");
  const auto said = [&] { return plant_.log(); };
  ASSERT_TRUE(Plant::eventually([&] {
    EXPECT_EQ(plant_.ask(ControlVerb::reset_statistics, "line1").code, ErrorCode::ok);
    const std::string before = said();
    EXPECT_EQ(plant_.ask(ControlVerb::reset_statistics, "line1").code, ErrorCode::ok);
    return !Plant::within(std::chrono::milliseconds(300), [&] { return said() != before; });
  }));
  EXPECT_EQ(reload_with({"[dds]\n", "log_level = \"info\"\n[dds]\n"}).text,
            "[host] log_level changed, used at once");
  EXPECT_TRUE(Plant::eventually([&] {
    const std::string before = said();
    EXPECT_EQ(plant_.ask(ControlVerb::reset_statistics, "line1").code, ErrorCode::ok);
    return Plant::within(std::chrono::milliseconds(300), [&] { return said() != before; });
  }));
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "drive1").code, ErrorCode::ok);
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

}  // namespace
}  // namespace plchost
