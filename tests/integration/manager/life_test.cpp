// The life cycle of an application through a real manager.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "shm/base/names.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/integration/manager/plant.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

// The application holds the cycle of its task Output, which drives outputs, until it is let go.
class HeldPlant {
 public:
  explicit HeldPlant(int limit_ms) {
    plant_.write_file("line1.cfg", fmt::format("[CmpSchedule]\nWatchdog.DefaultTimeMs=0\n"
                                               "Stop.OutputsLimitMs={0}\n[Task.Output]\nDrivesOutputs=1\n",
                                               limit_ms));
    plant_.add("line1", "held", "settings = \"line1.cfg\"");
    plant_.start_manager();
    EXPECT_TRUE(plant_.wait_for("line1", InstanceState::running));
    EXPECT_EQ(post("hold_output"), PostResult::posted);
    EXPECT_TRUE(plant_.wait_for_cycles("line1", 20));  // of others: Output comes before them
  }
  /// Asks to stop, and does not wait for the answer.
  PacketSocket begin_stop() {
    PacketSocket socket = plant_.connect();
    EXPECT_TRUE(socket.send(
        encode(ControlRequest{.number = 1, .verb = ControlVerb::stop, .instance = "line1", .argument = ""})));
    // On a slow machine the time of the stop may be over already.
    EXPECT_TRUE(Plant::eventually([&] { return plant_.status("line1").state != InstanceState::running; }));
    return socket;
  }
  /// In the first phase the other tasks run on.
  void let_go() { EXPECT_EQ(post("let_go"), PostResult::posted); }
  Plant& plant() { return plant_; }

 private:
  PostResult post(const std::string& event) {
    auto pool = ObjectPool::create(plant_.pool());
    if (!pool) return PostResult::not_registered;
    const auto found = pool->create_event(event_object_name("line1", event));
    return found ? found->post() : PostResult::not_registered;
  }
  Plant plant_;
};

TEST(ManagerLife, GoesOnWithAStopThatItsPredecessorDidNotSeeTheEndOf) {
  HeldPlant held(10'000);
  Plant& plant = held.plant();
  const int pid = plant.status("line1").pid;
  const PacketSocket asker = held.begin_stop();
  plant.kill_manager();
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::stopping));
  held.let_go();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::stopped));
  EXPECT_EQ(plant.status("line1").pid, pid);
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::ok);
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
}

TEST(ManagerLife, ShowsTheExceptionOfAStopThatItsPredecessorBegan) {
  HeldPlant held(2'000);
  Plant& plant = held.plant();
  const PacketSocket asker = held.begin_stop();
  plant.kill_manager();
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::exception));
  EXPECT_THAT(std::string(plant.status("line1").problem.view()), HasSubstr("task Output"));
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::wrong_state);
  EXPECT_EQ(plant.ask(ControlVerb::reset, "line1").code, ErrorCode::ok);
  EXPECT_EQ(plant.status("line1").state, InstanceState::stopped);
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::ok);
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
}

}  // namespace
}  // namespace plchost
