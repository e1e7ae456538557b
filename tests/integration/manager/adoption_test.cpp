#include <csignal>
#include <filesystem>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/resource.h>

#include "tests/integration/manager/costs_cycles.hpp"
#include "tests/integration/manager/plant.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(Manager, StopsNoInstanceWhenItIsKilledAndTheNextOneAdoptsThem) {
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.add("drive1", "drive_axis");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  ASSERT_TRUE(plant.wait_for("drive1", InstanceState::running));
  EXPECT_EQ(plant.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
  EXPECT_EQ(plant.ask(ControlVerb::set_scheduler, "drive1", "CmpScheduleTimer").code, ErrorCode::ok);
  const int line = plant.status("line1").pid;
  const int drive = plant.status("drive1").pid;
  EXPECT_FALSE(costs_cycles(plant, "drive1", [&](std::uint32_t /*round*/) {
    plant.kill_manager();
    EXPECT_TRUE(plant.wait_for_cycles("drive1", 50));
    plant.start_manager();
    EXPECT_TRUE(plant.wait_for("drive1", InstanceState::running));
    EXPECT_TRUE(plant.wait_for("line1", InstanceState::stopped));
  }));
  EXPECT_EQ(plant.status("line1").pid, line);
  EXPECT_EQ(plant.status("drive1").pid, drive);
  EXPECT_EQ(plant.status("drive1").core, 0);
  EXPECT_EQ(plant.status("drive1").scheduler.view(), "CmpScheduleTimer");
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::ok);

  // It goes on supervising them.
  auto process = open_process(drive);
  ASSERT_TRUE(process);
  ASSERT_TRUE(signal_process(*process, SIGKILL));
  ASSERT_TRUE(Plant::eventually([&] { return plant.status("drive1").restarts == 1; }));
  ASSERT_TRUE(plant.wait_for("drive1", InstanceState::running));
  EXPECT_THAT(std::string(plant.status("drive1").problem.view()),
              HasSubstr("status unknown: it was adopted"));
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), IsEmpty());
}

// The forked process has the instance's name and its control socket.
TEST(Manager, BringsAnAdoptedInstanceBackWhoseApplicationHasLeftAProcessBehind) {
  Plant plant;
  plant.add("line1", "fault_forks", "restart_delay_ms = 10");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  plant.kill_manager();
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  plant.kill_instances();
  ASSERT_TRUE(Plant::eventually([&] { return plant.status("line1").restarts > 0; }));
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_EQ(plant.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");  // a killed process leaves its children behind
}

TEST(Manager, TriesAgainWhileItHasNoDescriptorsForAStart) {
  Plant plant;
  plant.add("line1", "bottling_line", "restart_delay_ms = 10");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const int manager = plant.manager_pid();
  rlimit before{};
  ASSERT_EQ(::prlimit(manager, RLIMIT_NOFILE, nullptr, &before), 0);
  const rlimit none{.rlim_cur = 3, .rlim_max = before.rlim_max};
  ASSERT_EQ(::prlimit(manager, RLIMIT_NOFILE, &none, nullptr), 0);
  plant.kill_instances();
  EXPECT_TRUE(Plant::eventually(
      [&] { return plant.status("line1").problem.view().find("EMFILE") != std::string_view::npos; }));
  EXPECT_EQ(plant.status("line1").state, InstanceState::waiting) << plant.status("line1").problem.view();
  ASSERT_EQ(::prlimit(manager, RLIMIT_NOFILE, &before, nullptr), 0);
  EXPECT_TRUE(plant.wait_for("line1", InstanceState::running));
}

TEST(Manager, LeavesNoTrialOfAnApplicationBehind) {
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const std::string endless = plant.run_directory() + "/endless.so";
  std::filesystem::copy_file(Plant::application("fault_loops"), endless);
  auto link = plant.connect();
  ASSERT_TRUE(link.send(encode(ControlRequest{
      .number = 1, .verb = ControlVerb::load_application, .instance = "line1", .argument = endless})));
  ASSERT_TRUE(Plant::eventually([&] { return Plant::processes_about(endless) > 0; }));
  plant.kill_manager();
  EXPECT_TRUE(Plant::within(std::chrono::seconds(5), [&] { return Plant::processes_about(endless) == 0; }));
}

TEST(Manager, IsRefusedWhileAnotherOneRuns) {
  Plant plant;
  plant.add("line1", "bottling_line", "autostart = false");
  plant.start_manager();
  EXPECT_THAT(plant.start_refused_manager(),
              HasSubstr("another manager runs with this run directory: process "));
  EXPECT_EQ(plant.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);  // the first is unharmed
}

TEST(Manager, SurvivesGarbageOnItsControlSocket) {
  Plant plant;
  plant.add("line1", "bottling_line", "autostart = false");
  plant.start_manager();
  auto hostile = plant.connect();
  for (const std::string_view packet : {"", "x", "{}", "[1,2", "{\"version\":2,\"number\":-1}"}) {
    (void)hostile.send(packet);
    hostile = plant.connect();
  }
  (void)hostile.send("{\"version\":2}");
  const auto reply = receive_until(hostile, MonotonicClock::now() + std::chrono::seconds(30));
  ASSERT_TRUE(reply) << reply.error().describe();
  EXPECT_EQ(decode_reply(*reply)->code, ErrorCode::corrupt);
  // A client that goes away in the middle of its request.
  (void)hostile.send(
      encode(ControlRequest{.number = 1, .verb = ControlVerb::start, .instance = "line1", .argument = ""}));
  hostile.close();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_EQ(plant.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
}

}  // namespace
}  // namespace plchost
