// A disk that hangs, also when it is read: no manager and no PLC waits for it for longer than a limit.

#include <cstdlib>
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

/// For the processes that are started while it lives: as long as freeze() holds, nothing in a folder of
/// wishes can be opened.
class StuckDisk {
 public:
  StuckDisk() {
    ::setenv("LD_PRELOAD", STUCK_DISK, 1);
    ::setenv("STUCK_DISK", flag_.c_str(), 1);
    ::setenv("STUCK_PATH", "/wishes.", 1);
    freeze();
  }
  ~StuckDisk() {
    thaw();
    for (const char* const name : {"LD_PRELOAD", "STUCK_DISK", "STUCK_PATH"}) ::unsetenv(name);
  }
  StuckDisk(const StuckDisk&) = delete;
  StuckDisk& operator=(const StuckDisk&) = delete;
  void freeze() const { std::ofstream(flag_) << "frozen"; }
  void thaw() const { std::filesystem::remove(flag_); }

 private:
  std::string flag_ = own_path("stuck");
};

class DiskThatHangs : public testing::Test {
 protected:
  /// line1 was stopped by an operator, drive1 runs; the manager was killed.
  void leave_plant() {
    plant_.add("line1", "bottling_line");
    plant_.add("drive1", "drive_axis");
    plant_.start_manager();
    ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
    ASSERT_TRUE(plant_.wait_for("drive1", InstanceState::running));
    ASSERT_EQ(plant_.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
    const auto is_on_disk = [&] {
      return !plant_.ask(ControlVerb::stop, "line1").text.contains("power cut");
    };
    ASSERT_TRUE(Plant::eventually(is_on_disk));
    plant_.kill_manager();
  }

  Plant plant_;
};

TEST_F(DiskThatHangs, WhenAManagerStartsHidesNothingThatIsInMemory) {
  leave_plant();
  const int drive1 = plant_.status("drive1").pid;
  const StuckDisk disk;
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("drive1", InstanceState::running));
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::stopped));
  EXPECT_EQ(plant_.status("drive1").pid, drive1);
  EXPECT_THAT(plant_.log(), HasSubstr("its wanted state is taken from memory"));
  EXPECT_EQ(plant_.ask(ControlVerb::reset_statistics, "drive1").text, "");
  EXPECT_THAT(plant_.ask(ControlVerb::set_scheduler, "drive1", "CmpScheduleTimer").text,
              HasSubstr("a power cut would undo it"));
  const auto stopped = plant_.ask(ControlVerb::stop, "drive1");
  EXPECT_EQ(stopped.code, ErrorCode::ok);
  EXPECT_THAT(stopped.text, HasSubstr("the disk has not taken it within 2 s"));
  // Processes that end now are started, or not, by what was asked for last.
  plant_.kill_manager();
  plant_.kill_instances();
  plant_.start_manager();
  EXPECT_FALSE(Plant::within(std::chrono::seconds(2), [&] {
    return plant_.status("drive1").state == InstanceState::running ||
           plant_.status("line1").state == InstanceState::running;
  }));
  disk.thaw();
  EXPECT_EQ(plant_.stop_manager().describe(), "exit code 0");
}

TEST_F(DiskThatHangs, AfterAPowerCutStartsNothingOnAGuess) {
  leave_plant();
  plant_.kill_instances();
  plant_.lose_memory();
  const StuckDisk disk;
  plant_.start_manager();
  for (const char* const name : {"line1", "drive1"}) {
    ASSERT_TRUE(plant_.wait_for(name, InstanceState::failed));
    EXPECT_THAT(std::string(plant_.status(name).problem.view()),
                HasSubstr("the disk has not answered within"));
  }
  disk.thaw();
  EXPECT_EQ(plant_.ask(ControlVerb::start, "drive1").code, ErrorCode::ok);
  EXPECT_TRUE(plant_.wait_for("drive1", InstanceState::running));
  EXPECT_EQ(plant_.status("line1").state, InstanceState::failed);
  EXPECT_EQ(plant_.stop_manager().describe(), "exit code 0");
}

}  // namespace
}  // namespace plchost
