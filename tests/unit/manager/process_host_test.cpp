#include "manager/supervisor/process_host.hpp"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "shm/pages/log_ring.hpp"
#include "shm/process/dynamic_loader.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

/// A host whose instance is a shell script.
class ProcessHostTest : public ::testing::Test, public InstanceEvents {
 protected:
  ProcessHostTest() {
    std::filesystem::create_directory(folder_);
    sut_.connect_events(*this);
  }
  ~ProcessHostTest() override {
    LogRing::remove(pool_, "line1");
    std::filesystem::remove_all(folder_);
  }
  void on_report(const SetupReport& /*report*/) override {}
  void on_reply(const ControlReply& /*reply*/) override {}
  void on_timer() override {}
  void on_application_checked(const Result<void>& /*result*/) override {}
  void on_exit(const ExitStatus& status) override {
    end_ = status;
    said_ = sut_.last_line();
    reactor_->stop();
  }
  void run(const std::string& script) {
    const std::string program = folder_ / "plc-instance";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    const auto pid = sut_.spawn({});
    ASSERT_TRUE(pid) << pid.error().describe();
    ASSERT_TRUE(reactor_->run());
  }

  std::string pool_ = own_name("host");
  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / own_name("host");
  std::unique_ptr<Reactor> reactor_ = std::move(*Reactor::create());
  ProcessHost sut_{
      *reactor_,
      {.program = folder_ / "plc-instance", .name = "line1", .pool = pool_, .run_directory = folder_}};
  ExitStatus end_;
  std::string said_;
};

TEST_F(ProcessHostTest, KnowsTheLastLineOfAProcessWhenItHasEnded) {
  run("echo first; printf 'x: error while loading shared libraries: y: Error 24' >&2; exit 127");
  EXPECT_TRUE(end_.exited_with(kExitNotLoaded));
  EXPECT_EQ(said_, "x: error while loading shared libraries: y: Error 24");
}

// The loader begins with the path of the program, and ends with the cause.
TEST_F(ProcessHostTest, KnowsTheEndOfALongLastLine) {
  run("printf '/%0600d: error while loading shared libraries: y: Error 24' 0 >&2; exit 127");
  EXPECT_EQ(said_.size(), InstanceOutput::kLastLine);
  EXPECT_TRUE(said_.ends_with("00: error while loading shared libraries: y: Error 24")) << said_;
}

TEST_F(ProcessHostTest, TakesNoLineOfAnEarlierProcess) {
  run("echo first");
  EXPECT_EQ(said_, "first");
  run("exit 127");
  EXPECT_EQ(said_, "");
}

}  // namespace
}  // namespace plchost
