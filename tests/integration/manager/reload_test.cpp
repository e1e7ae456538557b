// A configuration that is changed while instances run, and read again.

#include <csignal>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "instances/launch/launch_contract.hpp"
#include "manager/config/config_changes.hpp"
#include "shm/base/thread.hpp"
#include "shm/files/memory_file.hpp"
#include "tests/integration/manager/costs_cycles.hpp"
#include "tests/integration/manager/plant.hpp"
#include "tests/support/receive_until.hpp"
#include "tests/support/sanitized.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class Reload : public testing::Test {
 protected:
  /// line1 and drive1 run.
  void start() {
    plant_.add("line1", "bottling_line");
    plant_.add("drive1", "drive_axis");
    plant_.start_manager();
    ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
    ASSERT_TRUE(plant_.wait_for("drive1", InstanceState::running));
    line1_ = plant_.status("line1").pid;
    drive1_ = plant_.status("drive1").pid;
  }
  ControlReply reload() {
    plant_.write_configuration();
    return plant_.ask(ControlVerb::reload_host, "");
  }
  /// Only line1 is left.
  void remove_drive1() {
    plant_.clear_instances();
    plant_.add("line1", "bottling_line");
    const auto reply = reload();
    ASSERT_EQ(reply.code, ErrorCode::ok) << reply.text;
    ASSERT_EQ(reply.text, "instance 'drive1': removed; it runs until it is stopped");
  }
  bool is_listed(const std::string& instance) { return plant_.status(instance).name.view() == instance; }
  bool disappears(const std::string& instance) {
    return Plant::eventually([&] { return !is_listed(instance); });
  }
  void expect_undisturbed(const std::string& instance, int pid) {
    EXPECT_EQ(plant_.status(instance).pid, pid);
    EXPECT_TRUE(plant_.wait_for_cycles(instance));
    EXPECT_EQ(plant_.status(instance).restarts, 0U);
  }
  void expect_nothing_left() {
    EXPECT_EQ(plant_.stop_manager().describe(), "exit code 0");
    EXPECT_THAT(plant_.leftovers(), IsEmpty());
  }

  Plant plant_;
  int line1_ = 0;
  int drive1_ = 0;
};

TEST_F(Reload, SaysSoWhenNothingHasChanged) {
  start();
  EXPECT_EQ(reload().text, "nothing has changed");
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

TEST_F(Reload, CostsNoCycleOfAnInstanceThatIsUnchanged) {
  start();
  EXPECT_FALSE(costs_cycles(plant_, "drive1", [&](std::uint32_t round) {
    plant_.add(fmt::format("spare{}", round), "packer", "autostart = false");
    EXPECT_EQ(reload().code, ErrorCode::ok);
  }));
  expect_undisturbed("drive1", drive1_);
}

TEST_F(Reload, StartsWhatIsNewAndLeavesTheOthersAlone) {
  start();
  plant_.add("packer1", "packer", "after = [\"line1\"]");
  plant_.add("spare", "packer", "autostart = false");
  const auto reply = reload();
  EXPECT_EQ(reply.code, ErrorCode::ok);
  EXPECT_EQ(reply.text, "instance 'packer1': new\ninstance 'spare': new");
  ASSERT_TRUE(plant_.wait_for("packer1", InstanceState::running));
  EXPECT_TRUE(is_listed("spare"));
  EXPECT_EQ(plant_.status("spare").pid, 0);
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.ask(ControlVerb::start, "spare").code, ErrorCode::ok);
  expect_nothing_left();
}

TEST_F(Reload, LetsARemovedInstanceRunUntilItIsStopped) {
  start();
  remove_drive1();
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.status("drive1").removed, 1U);
  EXPECT_THAT(std::string(plant_.status("drive1").problem.view()),
              HasSubstr("removed from the configuration"));
  for (const ControlVerb verb : {ControlVerb::restart, ControlVerb::reset, ControlVerb::start}) {
    const auto refused = plant_.ask(verb, "drive1");
    EXPECT_EQ(refused.code, ErrorCode::wrong_state);
    EXPECT_THAT(refused.text, HasSubstr("removed from the configuration"));
  }
  const auto stopped = plant_.ask(ControlVerb::stop, "drive1");
  EXPECT_EQ(stopped.code, ErrorCode::ok) << stopped.text;
  EXPECT_TRUE(disappears("drive1"));
  EXPECT_EQ(plant_.ask(ControlVerb::start, "drive1").code, ErrorCode::not_found);
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

TEST_F(Reload, DoesNotRestartARemovedInstanceThatCrashes) {
  start();
  const std::string settings = kept_settings_path(plant_.run_directory(), "drive1");
  EXPECT_TRUE(Plant::eventually([&] { return std::filesystem::exists(settings); }));
  remove_drive1();
  auto process = open_process(drive1_);
  ASSERT_TRUE(process);
  ASSERT_TRUE(signal_process(*process, SIGKILL));
  EXPECT_TRUE(disappears("drive1"));
  const auto pages = InstancePageReader::open(plant_.pool(), "drive1");
  EXPECT_FALSE(pages) << "its page is removed with it";
  EXPECT_FALSE(std::filesystem::exists(settings)) << "they are those of no process any more";
  expect_nothing_left();
}

TEST_F(Reload, EndsARemovedInstanceWhoseApplicationDoesNotRun) {
  start();
  ASSERT_EQ(plant_.ask(ControlVerb::stop, "drive1").code, ErrorCode::ok);
  plant_.clear_instances();
  plant_.add("line1", "bottling_line");
  EXPECT_EQ(reload().text, "instance 'drive1': removed; its process ends");
  EXPECT_TRUE(disappears("drive1"));
  // It was stopped when it went, so it is stopped when it is back.
  plant_.add("drive1", "drive_axis");
  EXPECT_EQ(reload().text, "instance 'drive1': new");
  EXPECT_FALSE(Plant::within(std::chrono::seconds(1), [&] { return plant_.status("drive1").pid != 0; }));
  EXPECT_EQ(plant_.ask(ControlVerb::start, "drive1").code, ErrorCode::ok);
  EXPECT_TRUE(plant_.wait_for("drive1", InstanceState::running));
  expect_nothing_left();
}

TEST_F(Reload, TakesARemovedInstanceBack) {
  start();
  remove_drive1();
  plant_.add("drive1", "drive_axis");
  EXPECT_EQ(reload().text, "instance 'drive1': in the configuration again");
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.status("drive1").removed, 0U);
  EXPECT_TRUE(plant_.status("drive1").problem.view().empty()) << plant_.status("drive1").problem.view();
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "drive1").code, ErrorCode::ok);
  expect_nothing_left();
}

TEST_F(Reload, LeavesWhatNeedsARestartForIt) {
  start();
  plant_.write_file("drive1.cfg", "[CmpSchedule]\nSchedulerInterval=2000\n");
  plant_.clear_instances();
  plant_.add("line1", "bottling_line", "crash_limit = 9\nautostart = false");
  plant_.add("drive1", "packer", "settings = \"drive1.cfg\"\nscheduler = \"CmpScheduleTimer\"");
  const auto reply = reload();
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
  EXPECT_EQ(
      reply.text,
      "instance 'line1': crash_limit changed, used at once\n"
      "instance 'line1': autostart changed, used when the host starts the next time; until then start and "
      "stop decide\n"
      "instance 'drive1': scheduler, settings, application changed, used from the next start or restart "
      "of the instance");
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  EXPECT_THAT(std::string(plant_.status("drive1").application.view()), HasSubstr("drive_axis"));
  EXPECT_THAT(std::string(plant_.status("drive1").problem.view()),
              HasSubstr("the configuration has changed"));
  EXPECT_EQ(reload().text, "nothing has changed");
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "drive1").code, ErrorCode::ok);
  EXPECT_THAT(std::string(plant_.status("drive1").application.view()), HasSubstr("packer"));
  EXPECT_EQ(plant_.status("drive1").scheduler.view(), "CmpScheduleTimer");
  EXPECT_TRUE(plant_.status("drive1").problem.view().empty()) << plant_.status("drive1").problem.view();
  expect_nothing_left();
}

TEST_F(Reload, ChangesNothingWhenTheFileIsFaulty) {
  start();
  plant_.add("packer1", "packer", "restart = \"sometimes\"");
  const auto reply = reload();
  EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
  EXPECT_THAT(reply.text, AllOf(HasSubstr("cell.toml:"), HasSubstr("restart"), HasSubstr("on-failure")));
  EXPECT_FALSE(is_listed("packer1"));
  plant_.write_configuration("[host\n");
  EXPECT_THAT(plant_.ask(ControlVerb::reload_host, "").text, HasSubstr("cell.toml:1"));
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  expect_nothing_left();
}

// The findings of --check-config, and not only those of the file by itself.
TEST_F(Reload, ChangesNothingWhenAnApplicationIsNone) {
  start();
  plant_.write_file("lamp.so", "no shared object");
  plant_.write_configuration(
      plant_.configuration() +
      "[[instance]]\nname = \"lamp\"\ncore = 0\nshare_core = true\napplication = \"lamp.so\"\n");
  const auto reply = plant_.ask(ControlVerb::reload_host, "");
  EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
  EXPECT_THAT(reply.text, AllOf(HasSubstr("lamp.so"), HasSubstr("'lamp' application")));
  EXPECT_FALSE(is_listed("lamp"));
  expect_nothing_left();
}

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
  EXPECT_FALSE(Plant::within(std::chrono::seconds(1), [&] { return servers().size() > 1; }));
  ASSERT_TRUE(signal_process(*process, SIGCONT));
  EXPECT_TRUE(receive_until(link, MonotonicClock::now() + std::chrono::seconds(30)));
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

TEST_F(Reload, IsDoneForASignal) {
  start();
  plant_.add("packer1", "packer");
  plant_.write_configuration();
  plant_.signal_manager(SIGHUP);
  plant_.signal_manager(SIGHUP);
  EXPECT_TRUE(plant_.wait_for("packer1", InstanceState::running));
  EXPECT_THAT(plant_.log(), HasSubstr("reload: instance 'packer1': new"));
  expect_undisturbed("line1", line1_);
  expect_nothing_left();
}

TEST_F(Reload, IsDoneOnceForEachOfSeveralThatCome) {
  start();
  plant_.add("packer1", "packer");
  plant_.write_configuration();
  auto link = plant_.connect();
  for (std::uint64_t number = 1; number <= 3; ++number) {
    ASSERT_TRUE(link.send(encode(
        ControlRequest{.number = number, .verb = ControlVerb::reload_host, .instance = "", .argument = ""})));
  }
  std::string all;
  for (int i = 0; i < 3; ++i) {
    const auto packet = receive_until(link, MonotonicClock::now() + std::chrono::seconds(30));
    ASSERT_TRUE(packet);
    all += decode_reply(*packet)->text + "\n";
  }
  EXPECT_EQ(all, "instance 'packer1': new\nnothing has changed\nnothing has changed\n");
  expect_nothing_left();
}

TEST_F(Reload, TakesOverWhileAnInstanceStarts) {
  plant_.add("line1", "bottling_line");
  plant_.start_manager();
  plant_.clear_instances();
  plant_.add("line1", "bottling_line", "restart = \"always\"");
  plant_.add("drive1", "drive_axis");
  const auto reply = reload();
  EXPECT_EQ(reply.text, "instance 'line1': restart changed, used at once\ninstance 'drive1': new");
  EXPECT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(plant_.wait_for("drive1", InstanceState::running));
  expect_nothing_left();
}

TEST_F(Reload, IsNotLostWhenTheManagerIsKilledRightAfterIt) {
  start();
  plant_.clear_instances();
  plant_.add("line1", "packer");
  plant_.add("packer1", "packer");
  ASSERT_EQ(reload().code, ErrorCode::ok);
  plant_.kill_manager();
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  ASSERT_TRUE(plant_.wait_for("packer1", InstanceState::running));
  expect_undisturbed("line1", line1_);
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.status("drive1").removed, 1U);
  EXPECT_THAT(std::string(plant_.status("line1").problem.view()), HasSubstr("the configuration has changed"));
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "line1").code, ErrorCode::ok);
  EXPECT_THAT(std::string(plant_.status("line1").application.view()), HasSubstr("packer"));
  EXPECT_EQ(plant_.ask(ControlVerb::stop, "drive1").code, ErrorCode::ok);
  EXPECT_TRUE(disappears("drive1"));
  expect_nothing_left();
}

TEST_F(Reload, AManagerListsWhatRunsAndWasRemovedWhileNoManagerRan) {
  start();
  plant_.kill_manager();
  plant_.clear_instances();
  plant_.add("line1", "bottling_line");
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("drive1", InstanceState::running));
  expect_undisturbed("drive1", drive1_);
  // It was running for the manager before, too.
  EXPECT_TRUE(Plant::eventually([&] { return plant_.status("drive1").removed == 1; }));
  plant_.add("drive1", "drive_axis");
  EXPECT_THAT(reload().text, AllOf(HasSubstr("in the configuration again"), Not(HasSubstr("has changed"))));
  expect_undisturbed("drive1", drive1_);
  EXPECT_EQ(plant_.ask(ControlVerb::restart, "drive1").code, ErrorCode::ok);
  expect_nothing_left();
}

// It ends with the host, as all do.
TEST_F(Reload, EndsARemovedInstanceWithTheManager) {
  start();
  remove_drive1();
  expect_nothing_left();
  EXPECT_NE(::kill(drive1_, 0), 0);
}

}  // namespace
}  // namespace plchost
