#include "instances/runtime/tasks/event_table.hpp"

#include <optional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "shm/base/transient.hpp"
#include "tests/support/held_pool_lock.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

class EventTableTest : public ::testing::Test {
 protected:
  ~EventTableTest() override { ObjectPool::remove(name_); }

  std::string name_ = own_name("events");
  ObjectPool pool_ = ObjectPool::create(name_, {.max_objects = 16384}).value();
  EventTable sut_{"line1", &pool_};
};

TEST_F(EventTableTest, PostTellsWhetherItIsRegisteredAndBound) {
  const RTS_HANDLE handle = sut_.open("ready").value();
  EXPECT_EQ(sut_.post(handle), ERR_NO_OBJECT);
  ASSERT_TRUE(sut_.register_by_application(handle));
  EXPECT_EQ(sut_.post(handle), ERR_NO_TASK);
  CountedEvent* const counted = sut_.bind_task("ready").value();
  sut_.publish_bound(true);
  EXPECT_EQ(sut_.post(handle), ERR_OK);
  EXPECT_EQ(counted->count(), 2U);
}

TEST_F(EventTableTest, SetNeedsNoRegistrationButATask) {
  const RTS_HANDLE handle = sut_.open("ready").value();
  EXPECT_EQ(sut_.set(handle), ERR_NO_TASK);
  CountedEvent* const counted = sut_.bind_task("ready").value();
  sut_.publish_bound(true);
  EXPECT_EQ(sut_.set(handle), ERR_OK);
  EXPECT_EQ(counted->count(), 1U);
}

TEST_F(EventTableTest, WithdrawsItsTasksOneByOne) {
  for (const char* const event : {"ready", "ready", "other"}) ASSERT_TRUE(sut_.bind_task(event));
  const PoolEvent ready = pool_.open_event("line1/ready").value();
  const PoolEvent other = pool_.open_event("line1/other").value();
  sut_.withdraw_task("ready");  // before any is bound
  EXPECT_EQ(ready.bound_tasks(), 0U);
  sut_.publish_bound(true);
  for (const std::uint32_t left : {1U, 0U, 0U}) {
    sut_.withdraw_task("ready");
    EXPECT_EQ(ready.bound_tasks(), left);
    EXPECT_EQ(other.bound_tasks(), 1U);
  }
  sut_.publish_bound(true);
  EXPECT_EQ(ready.bound_tasks(), 2U);
}

TEST_F(EventTableTest, NamesMeanTheSameEventOnce) {
  EXPECT_EQ(sut_.open("ready").value(), sut_.open("line1/ready").value());
  EXPECT_NE(sut_.open("ready").value(), sut_.open("line2/ready").value());
}

TEST_F(EventTableTest, PostsToAnotherInstanceOnceThatHasRegistered) {
  const RTS_HANDLE handle = sut_.open("packer1/product").value();
  ASSERT_TRUE(sut_.register_by_application(handle));  // gives access only
  EXPECT_EQ(sut_.post(handle), ERR_NO_OBJECT);
  EventTable packer("packer1", &pool_);
  ASSERT_TRUE(packer.register_by_application(packer.open("product").value()));
  EXPECT_EQ(sut_.post(handle), ERR_NO_TASK);
}

TEST_F(EventTableTest, RefusesHandlesThatItDidNotGive) {
  (void)sut_.open("ready");
  EXPECT_EQ(sut_.post(nullptr), ERR_PARAMETER);
  EXPECT_EQ(sut_.post(RTS_INVALID_HANDLE), ERR_PARAMETER);
  EXPECT_EQ(sut_.set(&sut_), ERR_PARAMETER);
}

TEST_F(EventTableTest, RefusesBadNames) {
  for (const char* const name : {"", "/", "line1/", "/ready", "a/b/c", "a b", "-x"}) {
    EXPECT_FALSE(sut_.open(name)) << name;
  }
  EXPECT_FALSE(sut_.bind_task("line2/ready"));
}

TEST_F(EventTableTest, OperatorAndApplicationRegisterIndependently) {
  const RTS_HANDLE handle = sut_.open("ready").value();
  ASSERT_TRUE(sut_.register_by_operator("ready"));
  ASSERT_TRUE(sut_.register_by_application(handle));
  EXPECT_EQ(sut_.register_by_application(handle).error().code, ErrorCode::already_exists);
  ASSERT_TRUE(sut_.unregister_by_application(handle));
  EXPECT_EQ(sut_.post(handle), ERR_NO_TASK);  // the operator's holds
  ASSERT_TRUE(sut_.unregister_by_operator("ready"));
  EXPECT_EQ(sut_.post(handle), ERR_NO_OBJECT);
  EXPECT_EQ(sut_.unregister_by_operator("ready").error().code, ErrorCode::not_found);
}

TEST_F(EventTableTest, IsFullAtItsBound) {
  for (std::size_t i = 0; i < EventTable::kMaxEvents; ++i) ASSERT_TRUE(sut_.open(fmt::format("e{}", i)));
  EXPECT_EQ(sut_.open("one-more").error().code, ErrorCode::full);
  EXPECT_TRUE(sut_.open("e0"));
}

TEST_F(EventTableTest, ClearsOnlyWhatIsItsOwn) {
  EventTable other("line10", &pool_);
  ASSERT_TRUE(other.register_by_application(other.open("ready").value()));
  ASSERT_TRUE(sut_.register_by_application(sut_.open("ready").value()));
  EventTable successor("line1", &pool_);
  ASSERT_TRUE(successor.clear_left_behind());
  EXPECT_FALSE(pool_.open_event("line1/ready").value().registered());
  EXPECT_TRUE(pool_.open_event("line10/ready").value().registered());
}

TEST_F(EventTableTest, WithdrawsItsOwnEventsAndNoOthers) {
  EventTable other("line2", &pool_);
  ASSERT_TRUE(other.register_by_application(other.open("ready").value()));
  ASSERT_TRUE(sut_.register_by_application(sut_.open("ready").value()));
  (void)sut_.open("line2/ready");
  ASSERT_TRUE(sut_.bind_task("ready"));
  sut_.publish_bound(true);
  sut_.withdraw_own();
  EXPECT_FALSE(pool_.open_event("line1/ready").value().registered());
  EXPECT_EQ(pool_.open_event("line1/ready").value().bound_tasks(), 0U);
  EXPECT_TRUE(pool_.open_event("line2/ready").value().registered());
}

// An event that is not cleared tells its posters that tasks take what nobody runs.
TEST_F(EventTableTest, SaysWhenThePoolIsLockedWhileItClears) {
  ASSERT_TRUE(sut_.register_by_application(sut_.open("ready").value()));
  std::optional<HeldPoolLock> held(name_);
  EventTable successor("line1", &pool_);
  const auto cleared = successor.clear_left_behind();
  held.reset();
  ASSERT_FALSE(cleared);
  EXPECT_TRUE(is_transient(cleared.error())) << cleared.error().describe();
}

TEST_F(EventTableTest, IsSeenToHoldWhatItRegistersAndBindsUntilItNeedsItNoMore) {
  const RTS_HANDLE handle = sut_.open("ready").value();
  EXPECT_FALSE(pool_.look_at("line1/ready")) << "a name alone holds nothing";
  ASSERT_TRUE(sut_.register_by_application(handle));
  EXPECT_EQ(pool_.look_at("line1/ready").value().reference_count, 1U);
  ASSERT_TRUE(sut_.unregister_by_application(handle));
  EXPECT_FALSE(pool_.look_at("line1/ready"));
  ASSERT_TRUE(sut_.bind_task("ready"));
  ASSERT_TRUE(sut_.register_by_application(handle));
  const auto used = pool_.look_at("line1/ready").value();
  ASSERT_EQ(used.references.size(), 1U);
  EXPECT_EQ(used.references[0].pid, static_cast<std::uint32_t>(::getpid()));
  ASSERT_TRUE(sut_.unregister_by_application(handle));
  EXPECT_EQ(pool_.look_at("line1/ready").value().reference_count, 1U) << "a task is still bound to it";
}

TEST_F(EventTableTest, KeepsTheEventOfAFirmwareThatEndedWhileTheTasksAreStopped) {
  {
    const auto firmware = pool_.create_shared_event("line1/ready").value();
    ASSERT_TRUE(sut_.bind_task("ready"));
    sut_.publish_bound(true);
  }
  sut_.publish_bound(false);
  sut_.publish_bound(true);
  EXPECT_EQ(pool_.look_at("line1/ready").value().bound_tasks, 1U);
}

/// Its pool is small, and gives the places of what nobody uses to others.
class EventTableOfASmallPool : public ::testing::Test {
 protected:
  ~EventTableOfASmallPool() override { ObjectPool::remove(name_); }

  /// Afterwards there is room again.
  void take_all_places() {
    int made = 0;
    while (pool_.create_semaphore(fmt::format("s{}", made), 0, {.keep = true})) ++made;
    for (int i = 0; i < made; ++i) ASSERT_TRUE(pool_.remove_object(fmt::format("s{}", i)));
  }
  [[nodiscard]] bool has_its_place() const { return pool_.open_event("line1/ready").has_value(); }

  std::string name_ = own_name("events");
  ObjectPool pool_ = ObjectPool::create(name_, {.max_objects = 64}).value();
  EventTable sut_{"line1", &pool_};
};

// Else the operator's next attempt is told that it is there, and the restart registers what nobody was told
// of.
TEST_F(EventTableOfASmallPool, RegistersForNobodyIfThePoolIsLocked) {
  const RTS_HANDLE handle = sut_.open("ready").value();
  take_all_places();
  ASSERT_FALSE(has_its_place());
  {
    const HeldPoolLock held(name_);
    for (const auto& refused : {sut_.register_by_operator("ready"), sut_.register_by_application(handle),
                                sut_.register_by_device("ready")}) {
      ASSERT_FALSE(refused);
      EXPECT_TRUE(is_transient(refused.error())) << refused.error().describe();
    }
  }
  EXPECT_THAT(sut_.registered_by_operator(), ::testing::IsEmpty());
  EXPECT_FALSE(sut_.is_by_application(handle));
  EXPECT_EQ(sut_.unregister_by_operator("ready").error().code, ErrorCode::not_found) << "nor by the device";
  EXPECT_EQ(sut_.post(handle), ERR_NO_OBJECT);
  ASSERT_TRUE(sut_.register_by_operator("ready"));
  EXPECT_THAT(sut_.registered_by_operator(), ::testing::ElementsAre("ready"));
  EXPECT_EQ(sut_.post(handle), ERR_NO_TASK);
}

TEST_F(EventTableOfASmallPool, UnregistersWithoutTheLockOfThePool) {
  const RTS_HANDLE handle = sut_.open("ready").value();
  {
    const HeldPoolLock held(name_);  // no reference is to be had
    ASSERT_TRUE(sut_.register_by_operator("ready"));
  }
  (void)pool_.open_event("line1/ready").value().set_registered(false);  // by a stranger
  take_all_places();
  ASSERT_FALSE(has_its_place());
  const HeldPoolLock held(name_);
  EXPECT_TRUE(sut_.unregister_by_operator("ready"));
  EXPECT_THAT(sut_.registered_by_operator(), ::testing::IsEmpty());
  EXPECT_EQ(sut_.post(handle), ERR_NO_OBJECT);
}

TEST_F(EventTableOfASmallPool, HoldsWhatTasksAreBoundToForTheirStart) {
  const RTS_HANDLE handle = sut_.open("ready").value();
  {
    const HeldPoolLock held(name_);  // no reference is to be had
    ASSERT_TRUE(sut_.bind_task("ready"));
  }
  ASSERT_TRUE(sut_.hold_bound());
  take_all_places();
  EXPECT_TRUE(has_its_place());
  EXPECT_EQ(sut_.set(handle), ERR_NO_TASK) << "the tasks do not run yet";
  sut_.publish_bound(true);
  EXPECT_EQ(sut_.set(handle), ERR_OK);
  sut_.publish_bound(false);
  take_all_places();
  EXPECT_FALSE(has_its_place()) << "it was held by nothing else";
  const auto lost = sut_.hold_bound();
  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().code, ErrorCode::wrong_state);
}

TEST(EventTableWithoutPool, OnlyCollects) {
  EventTable sut("check", nullptr);
  const RTS_HANDLE handle = sut.open("ready").value();
  EXPECT_TRUE(sut.register_by_application(handle));
  EXPECT_EQ(sut.post(handle), ERR_NO_TASK);
  EXPECT_EQ(sut.set(handle), ERR_NO_TASK);
}

}  // namespace
}  // namespace plchost
