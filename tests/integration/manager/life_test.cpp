// The life cycle of an application through a real manager.
#include <csignal>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "shm/base/names.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/integration/manager/plant.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

/// Asks to stop, and does not wait for the answer.
PacketSocket begin_stop(Plant& plant) {
  PacketSocket socket = plant.connect();
  EXPECT_TRUE(socket.send(
      encode(ControlRequest{.number = 1, .verb = ControlVerb::stop, .instance = "line1", .argument = ""})));
  // On a slow machine the time of the stop may be over already.
  EXPECT_TRUE(Plant::eventually([&] { return plant.status("line1").state != InstanceState::running; }));
  return socket;
}

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
    EXPECT_TRUE(plant_.eventually([&] { return plant_.cycles_of("line1", "HoldOutput") >= 1; }));
    // Its last cycle is the one that is held: others go on.
    EXPECT_TRUE(plant_.eventually([&] {
      const auto output = plant_.cycles_of("line1", "Output");
      const auto free = plant_.cycles_of("line1", "Free");
      return plant_.eventually([&] { return plant_.cycles_of("line1", "Free") > free + 20; }) &&
             plant_.cycles_of("line1", "Output") == output;
    }));
  }
  PacketSocket begin_stop() { return plchost::begin_stop(plant_); }
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

TEST(ManagerLife, CarriesOutAStopThatHasNotReachedTheProcess) {
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const int pid = plant.status("line1").pid;
  ASSERT_EQ(::kill(pid, SIGSTOP), 0);
  const PacketSocket asker = begin_stop(plant);
  plant.kill_manager();
  ASSERT_EQ(::kill(pid, SIGCONT), 0);
  plant.start_manager();
  EXPECT_TRUE(plant.wait_for("line1", InstanceState::stopped));
  EXPECT_EQ(plant.status("line1").pid, pid);
  EXPECT_THAT(plant.log(), HasSubstr("instance line1: stop, which an earlier manager has begun"));
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
