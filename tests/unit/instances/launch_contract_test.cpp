#include "instances/launch/launch_contract.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/setup/options.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;

ParsedOptions parse(const std::vector<std::string>& arguments) {
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  return parse_options(static_cast<int>(argv.size()), argv.data());
}

TEST(LaunchContract, CommandLineOfTheManagerIsUnderstoodByTheInstance) {
  const LaunchOptions options{.name = "line1",
                              .cores = {1, 3},
                              .scheduler = "CmpScheduleOneShot",
                              .priority_band = "high",
                              .kept_settings = true,
                              .settings = "/etc/line1.cfg",
                              .application = "/opt/line1.so",
                              .pool = "plant",
                              .run_directory = "/run/plant",
                              .state_directory = "/var/lib/plant",
                              .user = "plc",
                              .control_group = "/sys/fs/cgroup/a/line1",
                              .oom_score = -950,
                              .trusted_users = {7, 8},
                              .stopped = true,
                              .report_fd = 7,
                              .log_level = "debug"};
  const auto parsed = parse(to_arguments("plc-instance", options));
  ASSERT_TRUE(parsed.options);
  const LaunchOptions& sut = parsed.options->launch;
  EXPECT_EQ(sut.name, "line1");
  EXPECT_THAT(sut.cores, ElementsAre(1, 3));
  EXPECT_EQ(sut.scheduler, "CmpScheduleOneShot");
  EXPECT_EQ(parsed.options->band, PriorityBand::high);
  EXPECT_TRUE(sut.kept_settings);
  EXPECT_EQ(sut.settings, "/etc/line1.cfg");
  EXPECT_EQ(sut.application, "/opt/line1.so");
  EXPECT_EQ(sut.pool, "plant");
  EXPECT_EQ(sut.run_directory, "/run/plant");
  EXPECT_EQ(sut.state_directory, "/var/lib/plant");
  EXPECT_EQ(sut.user, "plc");
  EXPECT_EQ(sut.control_group, "/sys/fs/cgroup/a/line1");
  EXPECT_EQ(sut.oom_score, -950);
  EXPECT_THAT(sut.trusted_users, ElementsAre(7, 8));
  EXPECT_TRUE(sut.stopped);
  EXPECT_EQ(sut.report_fd, 7);
  EXPECT_EQ(sut.log_level, "debug");
}

TEST(LaunchContract, DefaultsNeedNoArguments) {
  LaunchOptions options;
  options.name = "line1";
  const auto parsed = parse(to_arguments("plc-instance", options));
  ASSERT_TRUE(parsed.options);
  EXPECT_TRUE(parsed.options->launch.cores.empty());
  EXPECT_EQ(parsed.options->launch.report_fd, -1);
}

TEST(LaunchContract, WrongArgumentsAreAUsageError) {
  EXPECT_EQ(parse({"plc-instance", "--core", "one"}).exit_code, kExitUsage);
  EXPECT_EQ(parse({"plc-instance", "--core", "1024"}).exit_code, kExitUsage);
  EXPECT_EQ(parse({"plc-instance", "--name", ""}).exit_code, kExitUsage);
  EXPECT_EQ(parse({"plc-instance", "--pool", "a/b"}).exit_code, kExitUsage);
  EXPECT_EQ(parse({"plc-instance", "surplus"}).exit_code, kExitUsage);
}

TEST(SetupReport, ComesBackAsItWasSent) {
  const auto sut = decode_report(
      encode(SetupReport{SetupStep::load_application, ErrorCode::not_found, "no \"x.so\"\n", true}));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->step, SetupStep::load_application);
  EXPECT_EQ(sut->code, ErrorCode::not_found);
  EXPECT_EQ(sut->text, "no \"x.so\"\n");
  EXPECT_TRUE(sut->transient);
}

TEST(SetupReport, WithBytesThatAreNotTextIsStillSent) {
  EXPECT_TRUE(decode_report(encode(SetupReport{SetupStep::ready, ErrorCode::ok, "\xff\xfe"})));
}

class BadReport : public ::testing::TestWithParam<const char*> {};

TEST_P(BadReport, IsCorrupt) {
  const auto sut = decode_report(GetParam());
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, ErrorCode::corrupt);
}

INSTANTIATE_TEST_SUITE_P(Packets, BadReport,
                         ::testing::Values("", "{", "[]", "{}", R"({"step":1,"code":0,"text":""})",
                                           R"({"step":"bind core","code":-1,"text":""})",
                                           R"({"step":"bind core","code":15,"text":""})",
                                           R"({"step":"bind core","code":4294967296,"text":""})",
                                           R"({"step":"bind core","code":0})",
                                           R"({"step":"fly","code":0,"text":""})"));

TEST(InstanceReport, ComesBackAsItWasSent) {
  const auto sut = decode_instance_report(encode(InstanceReport{.pid = 12,
                                                                .state = 5,
                                                                .problem = "task 'A'",
                                                                .application = "/a.so",
                                                                .scheduler = "CmpSchedule",
                                                                .cores = {1, 2},
                                                                .memory_locked = true}));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->pid, 12);
  EXPECT_EQ(sut->state, 5U);
  EXPECT_EQ(sut->problem, "task 'A'");
  EXPECT_EQ(sut->application, "/a.so");
  EXPECT_EQ(sut->scheduler, "CmpSchedule");
  EXPECT_THAT(sut->cores, ElementsAre(1, 2));
  EXPECT_TRUE(sut->memory_locked);
}

TEST(InstanceReport, WithAFieldMissingOrOfAnotherTypeIsCorrupt) {
  EXPECT_FALSE(decode_instance_report("{}"));
  EXPECT_FALSE(decode_instance_report(
      R"({"pid":"x","state":1,"problem":"","application":"","scheduler":"","cores":[],)"
      R"("memory_locked":true})"));
  EXPECT_FALSE(decode_instance_report(
      R"({"pid":1,"state":1,"problem":"","application":"","scheduler":"","cores":["a"],)"
      R"("memory_locked":true})"));
  EXPECT_FALSE(
      decode_instance_report(R"({"pid":1,"state":6,"problem":"","application":"","scheduler":"","cores":[],)"
                             R"("memory_locked":true})"))
      << "no such state";
}

TEST(LaunchContract, ControlSocketLiesInTheRunDirectory) {
  EXPECT_EQ(instance_socket_path("/run/plchost", "line1"), "/run/plchost/line1.sock");
}

}  // namespace
}  // namespace plchost
