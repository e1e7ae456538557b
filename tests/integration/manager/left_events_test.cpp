// The events of an instance whose process cannot take them back itself: the manager does. Else a poster would
// be told that a task runs what nobody runs.
#include <string>

#include <gtest/gtest.h>

#include "shm/pool/object_pool.hpp"
#include "tests/integration/manager/plant.hpp"

namespace plchost {
namespace {

class LeftEvents : public testing::Test {
 protected:
  LeftEvents() {
    add_line1();
    plant_.start_manager();
    EXPECT_TRUE(plant_.wait_for("line1", InstanceState::running)) << plant_.log();
    expect_taken();
  }
  void add_line1() { plant_.add("line1", "bottling_line", "restart = \"never\""); }
  [[nodiscard]] PostResult post() const {
    auto pool = ObjectPool::attach(plant_.pool());
    const auto event = pool ? pool->open_event("line1/stop") : failure_of_pool();
    return event ? event->post() : PostResult::not_registered;
  }
  void expect_taken() const {
    EXPECT_TRUE(Plant::eventually([&] { return post() == PostResult::posted; })) << plant_.log();
  }
  void expect_withdrawn() const {
    EXPECT_TRUE(Plant::eventually([&] { return post() == PostResult::not_registered; })) << plant_.log();
  }

  Plant plant_;

 private:
  static Result<PoolEvent> failure_of_pool() { return failure(ErrorCode::not_found, "no pool"); }
};

TEST_F(LeftEvents, TakeNoPostsAfterTheProcessWasKilledUntilTheNextOneRuns) {
  plant_.kill_instances();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::failed));
  EXPECT_EQ(post(), PostResult::not_registered);
  EXPECT_EQ(plant_.ask(ControlVerb::start, "line1").code, ErrorCode::ok);
  expect_taken();
}

TEST_F(LeftEvents, AreWithdrawnByTheNextManagerIfBothAreKilled) {
  plant_.kill_manager();
  plant_.kill_instances();
  EXPECT_EQ(post(), PostResult::posted) << "nobody can tell";
  plant_.clear_instances();
  add_line1();
  plant_.start_manager();
  expect_withdrawn();
}

TEST_F(LeftEvents, AreWithdrawnByAManagerWhoseConfigurationHasLostTheInstance) {
  plant_.kill_manager();
  plant_.kill_instances();
  plant_.clear_instances();
  plant_.start_manager();
  expect_withdrawn();
}

}  // namespace
}  // namespace plchost
