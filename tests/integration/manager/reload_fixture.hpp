#pragma once

#include <string>

#include <gmock/gmock.h>

#include "tests/integration/manager/plant.hpp"

namespace plchost {

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
    EXPECT_THAT(plant_.leftovers(), testing::IsEmpty());
  }

  Plant plant_;
  int line1_ = 0;
  int drive1_ = 0;
};

}  // namespace plchost
