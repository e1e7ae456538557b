// The outputs of tasks that a debugger halts, as a terminal sees them.
#include <csignal>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/files/pool_files.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/plc_process_image.h"
#include "tests/integration/instances/debugged_process.hpp"

namespace plchost::testing {
namespace {

constexpr std::uint32_t kSafe = 0x44332211;

class DebuggingOutputs : public Debugging {
 protected:
  DebuggingOutputs() {
    const auto area = [](int number, const char* flags, const char* object) {
      return fmt::format(
          "Linux.Area.{0}.Flags={1}\nLinux.Area.{0}.Object={2}\nLinux.Area.{0}.Size=4\n"
          "Linux.Area.{0}.SafeState=0x11223344\n",
          number, flags, object);
    };
    const std::string settings = "[SysMem]\n" + area(0, "0x8", "io.main") + area(1, "0x8000", "io.edge");
    start(application("steps"), {"--settings", sandbox_.write("line1.cfg", settings)});
    EXPECT_EQ(plc_image_open(sandbox_.pool().c_str(), "io.main", 4, PLC_IMAGE_READ, &main_), 0);
    EXPECT_EQ(plc_image_open(sandbox_.pool().c_str(), "io.edge", 4, PLC_IMAGE_READ, &edge_), 0);
    // With posts at once, Edge may run twice before the first cycle of Main.
    EXPECT_TRUE(becomes(main_, PLC_IMAGE_STATE_RUNNING));
    attach();
  }
  ~DebuggingOutputs() override {
    plc_image_close(&main_);
    plc_image_close(&edge_);
    process_.reset();
    remove_pool_memories(sandbox_.pool());
  }

  static std::uint32_t shown(const plc_image& image) {
    std::uint32_t word = 0;
    EXPECT_EQ(plc_image_read(&image, &word, nullptr), PLC_IMAGE_OK);
    return word;
  }
  static bool becomes(const plc_image& image, unsigned state) {
    return eventually([&] {
      return plc_image_state(&image) == state &&
             (shown(image) == kSafe) == (state != PLC_IMAGE_STATE_RUNNING);
    });
  }

  plc_image main_{};
  plc_image edge_{};
};

TEST_F(DebuggingOutputs, AreSafeWhileTheirTaskHaltsAndFollowItsCyclesAgain) {
  command("break Main:24");
  ASSERT_TRUE(becomes(main_, PLC_IMAGE_STATE_HALTED));
  ASSERT_TRUE(halts("Main"));
  EXPECT_EQ(stack_after("next"), "Main:26");
  EXPECT_TRUE(becomes(main_, PLC_IMAGE_STATE_HALTED));
  command("delete *");
  command("continue Main");
  EXPECT_TRUE(becomes(main_, PLC_IMAGE_STATE_RUNNING));
  const auto before = shown(main_);
  EXPECT_TRUE(eventually([&] { return shown(main_) > before; }));
}

TEST_F(DebuggingOutputs, OfATaskThatRunsOnceFollowTheCycleThatHalted) {
  PoolEvent event = process_->event("edge");
  event.post();
  ASSERT_TRUE(becomes(edge_, PLC_IMAGE_STATE_RUNNING));
  EXPECT_EQ(shown(edge_), 1U);
  command("break Edge");
  event.post();
  ASSERT_TRUE(becomes(edge_, PLC_IMAGE_STATE_HALTED));
  EXPECT_EQ(plc_image_state(&main_), PLC_IMAGE_STATE_RUNNING) << "another task, another area";
  const auto before = shown(main_);
  EXPECT_TRUE(eventually([&] { return shown(main_) > before; }));
  command("continue Edge");
  EXPECT_TRUE(becomes(edge_, PLC_IMAGE_STATE_RUNNING));
  EXPECT_TRUE(eventually([&] { return shown(edge_) == 2; }));
}

TEST_F(DebuggingOutputs, FollowWhenTheDebuggerLeavesAndWhenTheSchedulerIsExchanged) {
  command("break Main:24");
  ASSERT_TRUE(becomes(main_, PLC_IMAGE_STATE_HALTED));
  EXPECT_EQ(process_->ask(ControlVerb::set_scheduler, "CmpScheduleTimer").code, ErrorCode::ok);
  ASSERT_TRUE(halts("Main"));
  ASSERT_TRUE(becomes(main_, PLC_IMAGE_STATE_HALTED));
  command("detach");
  EXPECT_TRUE(becomes(main_, PLC_IMAGE_STATE_RUNNING));
}

TEST_F(DebuggingOutputs, AreStoppedByAStopAndDrivenByTheNextStart) {
  command("break Main:24");
  ASSERT_TRUE(becomes(main_, PLC_IMAGE_STATE_HALTED));
  ASSERT_EQ(process_->ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_EQ(plc_image_state(&main_), PLC_IMAGE_STATE_STOPPED);
  EXPECT_EQ(shown(main_), kSafe);
  command("delete *");
  ASSERT_EQ(process_->ask(ControlVerb::start).code, ErrorCode::ok);
  EXPECT_TRUE(becomes(main_, PLC_IMAGE_STATE_RUNNING));
}

TEST_F(DebuggingOutputs, StaySafeIfTheProcessIsKilled) {
  command("break Main:24");
  ASSERT_TRUE(becomes(main_, PLC_IMAGE_STATE_HALTED));
  EXPECT_EQ(process_->end(SIGKILL), -SIGKILL);
  EXPECT_EQ(plc_image_state(&main_), PLC_IMAGE_STATE_HALTED);
  EXPECT_EQ(shown(main_), kSafe);
  end_outputs(sandbox_.pool(), "line1");  // as a manager does
  EXPECT_EQ(plc_image_state(&main_), PLC_IMAGE_STATE_ENDED);
  EXPECT_EQ(shown(main_), kSafe);
}

}  // namespace
}  // namespace plchost::testing
