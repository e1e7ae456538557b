// The calls of a plc_app_init are collected, and change nothing before the commit: at the first load, and
// while another version runs.
#include <array>
#include <bit>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/application/application_host.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using ::testing::IsEmpty;

class CarriedVariablesOf : public ::testing::Test {
 protected:
  CarriedVariablesOf() { host_.begin_init(declaration_); }
  ApplicationHost host_{"test", nullptr};
  ApplicationDeclaration declaration_;
  std::array<char, 8> bytes_{};
};

TEST_F(CarriedVariablesOf, AnApplicationAreNamedInItsInit) {
  EXPECT_EQ(plc_keep_variables("a", bytes_.data(), 8, 3), ERR_OK);
  EXPECT_EQ(plc_keep_variables("a", bytes_.data(), 8, 3), ERR_DUPLICATE);
  host_.end_init();
  EXPECT_EQ(plc_keep_variables("b", bytes_.data(), 8, 3), ERR_NOTINITIALIZED);
  ASSERT_EQ(declaration_.variables.size(), 1U);
  const auto& [name, kept] = *declaration_.variables.begin();
  EXPECT_EQ(name, "a");
  EXPECT_EQ(kept.address, bytes_.data());
  EXPECT_EQ(kept.bytes, 8U);
  EXPECT_EQ(kept.layout, 3U);
}

TEST_F(CarriedVariablesOf, NoNameOrHalfOfAPlaceAreRefused) {
  EXPECT_EQ(plc_keep_variables(nullptr, bytes_.data(), 8, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables("", bytes_.data(), 8, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables("a b", bytes_.data(), 8, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables(std::string(PLC_MAX_VARIABLE_NAME + 1, 'x').c_str(), bytes_.data(), 8, 0),
            ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables("a", nullptr, 8, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables("a", bytes_.data(), 0, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables(std::string(PLC_MAX_VARIABLE_NAME, 'x').c_str(), bytes_.data(), 8, 0), ERR_OK);
}

TEST_F(CarriedVariablesOf, NothingAreComparedOnly) {
  EXPECT_EQ(plc_keep_variables("place", nullptr, 0, 17), ERR_OK);
  EXPECT_EQ(declaration_.variables.begin()->second.layout, 17U);
}

TEST_F(CarriedVariablesOf, AnApplicationHaveABound) {
  EXPECT_EQ(plc_keep_variables("all", bytes_.data(), PLC_MAX_VARIABLE_BYTES, 0), ERR_OK);
  EXPECT_EQ(plc_keep_variables("one", bytes_.data(), 1, 0), ERR_NOMEMORY);
}

TEST_F(CarriedVariablesOf, AnApplicationAreSoMany) {
  for (unsigned i = 0; i < PLC_MAX_VARIABLES; ++i) {
    ASSERT_EQ(plc_keep_variables(std::to_string(i).c_str(), bytes_.data(), 1, 0), ERR_OK) << i;
  }
  EXPECT_EQ(plc_keep_variables("one", bytes_.data(), 1, 0), ERR_NOMEMORY);
}

void callback(unsigned /*event*/, const EVTPARAM_ExternalEventTask* /*parameter*/, void* user) {
  ++*static_cast<int*>(user);
}

class FirstDeclaration : public ::testing::Test {
 protected:
  FirstDeclaration() { host_.begin_init(declaration_); }
  ApplicationHost host_{"test", nullptr};
  ApplicationDeclaration declaration_;
};

TEST_F(FirstDeclaration, HoldsFromTheCommitOn) {
  EXPECT_EQ(plc_online_change(), 0);
  RTS_RESULT result = ERR_FAILED;
  const RTS_HANDLE event = SchedRegisterExternalEvent("ready", &result);
  EXPECT_EQ(result, ERR_OK);
  EXPECT_EQ(SchedRegisterExternalEvent("ready", &result), event);
  EXPECT_EQ(result, ERR_DUPLICATE);
  int calls = 0;
  EXPECT_EQ(EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, callback, &calls), ERR_OK);
  host_.end_init();
  EXPECT_FALSE(host_.has_application());
  EXPECT_FALSE(host_.events().is_by_application(event));
  host_.notify(EVT_ExternalEventTaskCreateDone, {});
  EXPECT_EQ(calls, 0);
  ASSERT_TRUE(host_.reserve(declaration_));
  host_.commit(std::move(declaration_), [](const void*) { return false; });
  EXPECT_TRUE(host_.has_application());
  EXPECT_TRUE(host_.events().is_by_application(event));
  host_.notify(EVT_ExternalEventTaskCreateDone, {});
  EXPECT_EQ(calls, 1);
}

TEST_F(FirstDeclaration, WithdrawsAnEventThatItHasRegistered) {
  const RTS_HANDLE event = SchedRegisterExternalEvent("ready", nullptr);
  EXPECT_EQ(SchedUnregisterExternalEvent(event), ERR_OK);
  EXPECT_EQ(SchedUnregisterExternalEvent(event), ERR_NO_OBJECT);
  EXPECT_EQ(SchedUnregisterExternalEvent(RTS_INVALID_HANDLE), ERR_PARAMETER);
  EXPECT_THAT(declaration_.events, IsEmpty());
}

TEST_F(FirstDeclaration, OfAnEventOfAnotherInstanceOnlyGivesAccess) {
  RTS_RESULT result = ERR_FAILED;
  const RTS_HANDLE event = SchedRegisterExternalEvent("packer1/product", &result);
  EXPECT_EQ(result, ERR_OK);
  EXPECT_EQ(SchedRegisterExternalEvent("packer1/product", &result), event);
  EXPECT_EQ(result, ERR_OK);
  EXPECT_THAT(declaration_.events, IsEmpty());
}

TEST_F(FirstDeclaration, IsMadeInTheInitOnly) {
  host_.end_init();
  Task_Info info{};
  sys_setup_tasks_struct setup{.nTasks = 1, .stApplicationName = "Late", .ptaskinfo = &info};
  __sys__setup__tasks(&setup);
  EXPECT_EQ(declaration_.tasks, nullptr);
  Task_Options options{};
  options.dwSize = sizeof options;
  EXPECT_EQ(plc_set_task_options("Main", &options), ERR_NOTINITIALIZED);
  Plc_Area area{};
  area.dwSize = sizeof area;
  area.dwFlags = PLC_AREA_DATA;
  area.pszName = "late";
  area.dwBytes = 8;
  RTS_RESULT result = ERR_OK;
  EXPECT_EQ(plc_declare_area(&area, &result), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_NOTINITIALIZED);
}

class OnlineDeclaration : public ::testing::Test {
 protected:
  OnlineDeclaration() {
    ApplicationDeclaration first;
    host_.begin_init(first);
    __sys__setup__tasks(&setup_);
    before_ = SchedRegisterExternalEvent("before", nullptr);
    both_ = SchedRegisterExternalEvent("both", nullptr);
    EXPECT_EQ(EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, callback, &calls_before_),
              ERR_OK);
    host_.end_init();
    EXPECT_TRUE(host_.reserve(first));
    host_.commit(std::move(first), [](const void*) { return false; });
    const ApplicationHost::ComponentCode component(host_);
    of_component_ = SchedRegisterExternalEvent("component", nullptr);
    EXPECT_EQ(EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, callback, &calls_component_),
              ERR_OK);
  }
  bool is_registered(RTS_HANDLE event) { return host_.events().is_by_application(event); }
  void notify() { host_.notify(EVT_ExternalEventTaskCreateDone, {}); }

  ApplicationHost host_{"test", nullptr};
  Task_Info info_{};
  sys_setup_tasks_struct setup_{.nTasks = 1, .stApplicationName = "First", .ptaskinfo = &info_};
  ApplicationDeclaration online_;
  RTS_HANDLE before_ = nullptr;
  RTS_HANDLE both_ = nullptr;
  RTS_HANDLE of_component_ = nullptr;
  int calls_before_ = 0;
  int calls_component_ = 0;
  int calls_after_ = 0;
};

TEST_F(OnlineDeclaration, OfEventsAndCallbacksHoldsFromTheTakeoverOn) {
  EXPECT_EQ(plc_online_change(), 0);
  host_.begin_init(online_);
  EXPECT_EQ(plc_online_change(), 1);
  RTS_RESULT result = ERR_FAILED;
  EXPECT_EQ(SchedRegisterExternalEvent("both", &result), both_);
  EXPECT_EQ(result, ERR_OK);
  EXPECT_EQ(SchedRegisterExternalEvent("both", &result), both_);
  EXPECT_EQ(result, ERR_DUPLICATE);
  EXPECT_EQ(SchedRegisterExternalEvent("component", &result), of_component_);
  EXPECT_EQ(result, ERR_DUPLICATE);
  const RTS_HANDLE after = SchedRegisterExternalEvent("after", &result);
  EXPECT_EQ(result, ERR_OK);
  EXPECT_EQ(SchedUnregisterExternalEvent(before_), ERR_NO_OBJECT) << "it has not registered it";
  EXPECT_EQ(EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, callback, &calls_after_), ERR_OK);
  EXPECT_EQ(EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, callback, &calls_after_),
            ERR_DUPLICATE);
  EXPECT_EQ(EventUnregisterCallbackFunction(EVT_ExternalEventTaskCreateDone, callback, &calls_before_),
            ERR_NO_OBJECT);
  host_.end_init();
  EXPECT_EQ(plc_online_change(), 0);
  EXPECT_FALSE(is_registered(after));
  EXPECT_TRUE(is_registered(before_));
  notify();
  EXPECT_EQ(calls_before_, 1);
  EXPECT_EQ(calls_after_, 0);

  ASSERT_TRUE(host_.reserve(online_));
  EXPECT_TRUE(is_registered(after));
  host_.commit(std::move(online_), [](const void*) { return false; });
  EXPECT_TRUE(is_registered(before_)) << "a callback of the new version may register it";
  notify();
  host_.end_takeover();
  EXPECT_FALSE(is_registered(before_));
  EXPECT_TRUE(is_registered(both_));
  EXPECT_TRUE(is_registered(of_component_));
  EXPECT_EQ(calls_before_, 1) << "of the version before";
  EXPECT_EQ(calls_after_, 1);
  EXPECT_EQ(calls_component_, 2);

  host_.set_online_change(true);  // the plc_app_exit of the version before
  EXPECT_EQ(SchedUnregisterExternalEvent(both_), ERR_NO_OBJECT);
  EXPECT_EQ(SchedUnregisterExternalEvent(before_), ERR_NO_OBJECT);
  host_.set_online_change(false);
  EXPECT_TRUE(is_registered(both_));
}

// By callbacks: the one is registered by no later version, the others by its plc_app_init or its callback.
TEST_F(OnlineDeclaration, EndsEventsThatOnlyTheRunningApplicationHasRegisteredLater) {
  const RTS_HANDLE gone = SchedRegisterExternalEvent("gone", nullptr);
  const RTS_HANDLE declared = SchedRegisterExternalEvent("declared", nullptr);
  const RTS_HANDLE again = SchedRegisterExternalEvent("again", nullptr);
  host_.begin_init(online_);
  RTS_RESULT result = ERR_FAILED;
  EXPECT_EQ(SchedRegisterExternalEvent("declared", &result), declared);
  EXPECT_EQ(result, ERR_OK);
  host_.end_init();
  ASSERT_TRUE(host_.reserve(online_));
  host_.commit(std::move(online_), [](const void*) { return false; });
  for (const RTS_HANDLE event : {gone, declared, again}) EXPECT_TRUE(is_registered(event));
  EXPECT_EQ(SchedRegisterExternalEvent("again", &result), again);
  EXPECT_EQ(result, ERR_OK);
  host_.end_takeover();
  EXPECT_FALSE(is_registered(gone));
  EXPECT_TRUE(is_registered(declared));
  EXPECT_TRUE(is_registered(again));
  host_.set_online_change(true);  // the plc_app_exit of the version before
  for (const RTS_HANDLE event : {gone, declared, again}) {
    EXPECT_EQ(SchedUnregisterExternalEvent(event), ERR_NO_OBJECT);
  }
  EXPECT_EQ(SchedRegisterExternalEvent("late", &result), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_NOTINITIALIZED);
  host_.set_online_change(false);
  EXPECT_TRUE(is_registered(again));
}

TEST_F(OnlineDeclaration, OfAnEventOfAnotherInstanceOnlyGivesAccess) {
  host_.begin_init(online_);
  RTS_RESULT result = ERR_FAILED;
  const RTS_HANDLE event = SchedRegisterExternalEvent("packer1/product", &result);
  EXPECT_EQ(result, ERR_OK);
  EXPECT_NE(event, RTS_INVALID_HANDLE);
  host_.end_init();
  EXPECT_THAT(online_.events, IsEmpty());
}

TEST_F(OnlineDeclaration, RegistersAgainInACallbackWhatAnOperatorHasUnregistered) {
  ASSERT_TRUE(host_.events().unregister_by_operator("before"));
  host_.begin_init(online_);
  host_.end_init();
  ASSERT_TRUE(host_.reserve(online_));
  host_.commit(std::move(online_), [](const void*) { return false; });
  RTS_RESULT result = ERR_FAILED;
  EXPECT_EQ(SchedRegisterExternalEvent("before", &result), before_);
  EXPECT_EQ(result, ERR_OK);
  EXPECT_TRUE(is_registered(before_));
  host_.end_takeover();
  EXPECT_TRUE(is_registered(before_));
}

TEST_F(OnlineDeclaration, ThatIsNotTakenKeepsEventsThatWereRegisteredLater) {
  const RTS_HANDLE late = SchedRegisterExternalEvent("late", nullptr);
  host_.begin_init(online_);
  EXPECT_EQ(SchedRegisterExternalEvent("late", nullptr), late);
  host_.end_init();
  ASSERT_TRUE(host_.reserve(online_));
  host_.release(online_);
  EXPECT_TRUE(is_registered(late));
}

// An event that a callback of a component registers stays with the component.
void registers(unsigned /*event*/, const EVTPARAM_ExternalEventTask* /*parameter*/, void* user) {
  (void)SchedRegisterExternalEvent(static_cast<const char*>(user), nullptr);
}

TEST_F(OnlineDeclaration, KeepsEventsThatACallbackOfAComponentHasRegistered) {
  static std::string name = "of_callback";
  {
    const ApplicationHost::ComponentCode component(host_);
    EXPECT_EQ(EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, registers, name.data()), ERR_OK);
  }
  notify();
  const RTS_HANDLE event = SchedRegisterExternalEvent(name.c_str(), nullptr);
  EXPECT_TRUE(is_registered(event));
  host_.commit({}, [](const void*) { return false; });
  host_.end_takeover();
  EXPECT_TRUE(is_registered(event));
}

TEST_F(OnlineDeclaration, ThatIsNotTakenLeavesAllAsItWas) {
  host_.begin_init(online_);
  const RTS_HANDLE after = SchedRegisterExternalEvent("after", nullptr);
  host_.end_init();
  ASSERT_TRUE(host_.reserve(online_));
  host_.release(online_);
  host_.set_online_change(true);  // its plc_app_exit
  EXPECT_EQ(SchedUnregisterExternalEvent(after), ERR_NO_OBJECT);
  EXPECT_EQ(SchedUnregisterExternalEvent(both_), ERR_NO_OBJECT);
  host_.set_online_change(false);
  EXPECT_FALSE(is_registered(after));
  EXPECT_TRUE(is_registered(before_));
  EXPECT_TRUE(is_registered(both_));
}

TEST_F(OnlineDeclaration, ThatIsRefusedGivesBackTheEventsThatOnlyItHasOpened) {
  host_.begin_init(online_);
  const RTS_HANDLE after = SchedRegisterExternalEvent("after", nullptr);
  const RTS_HANDLE foreign = SchedRegisterExternalEvent("packer1/product", nullptr);
  EXPECT_EQ(SchedRegisterExternalEvent("both", nullptr), both_);
  host_.end_init();
  EXPECT_TRUE(host_.events().is_own(after));
  host_.end_version();
  EXPECT_FALSE(host_.events().is_own(after));
  EXPECT_EQ(SchedUnregisterExternalEvent(after), ERR_PARAMETER);
  EXPECT_EQ(SchedUnregisterExternalEvent(foreign), ERR_PARAMETER);
  EXPECT_TRUE(host_.events().is_own(both_));
  EXPECT_NE(SchedRegisterExternalEvent("other", nullptr), after) << "somebody may have kept that handle";
  EXPECT_EQ(SchedRegisterExternalEvent("after", nullptr), after);
}

TEST_F(OnlineDeclaration, ThatIsCommittedKeepsItsEventsWhenTheVersionBeforeIsGone) {
  host_.begin_init(online_);
  const RTS_HANDLE after = SchedRegisterExternalEvent("after", nullptr);
  host_.end_init();
  ASSERT_TRUE(host_.reserve(online_));
  host_.commit(std::move(online_), [](const void*) { return false; });
  host_.end_takeover();
  host_.set_online_change(true);  // the plc_app_exit of the version before
  EXPECT_EQ(SchedRegisterExternalEvent("late", nullptr), RTS_INVALID_HANDLE);
  host_.set_online_change(false);
  host_.end_version();
  EXPECT_TRUE(is_registered(after));
  EXPECT_NE(SchedRegisterExternalEvent("next", nullptr), after);
}

// They are opened by somebody else while the version waits for its moment.
TEST_F(OnlineDeclaration, ThatIsRefusedKeepsTheEventsThatOthersHaveOpened) {
  host_.begin_init(online_);
  const RTS_HANDLE by_operator = SchedRegisterExternalEvent("by_operator", nullptr);
  const RTS_HANDLE by_component = SchedRegisterExternalEvent("by_component", nullptr);
  host_.end_init();
  ASSERT_TRUE(host_.events().register_by_operator("by_operator"));
  {
    const ApplicationHost::ComponentCode component(host_);
    EXPECT_EQ(SchedRegisterExternalEvent("by_component", nullptr), by_component);
  }
  ASSERT_TRUE(host_.events().unregister_by_application(by_component));
  host_.end_version();
  EXPECT_TRUE(host_.events().is_own(by_operator));
  EXPECT_TRUE(host_.events().is_own(by_component));
}

TEST_F(OnlineDeclaration, ThatIsRefusedAgainAndAgainUsesUpNoEventsAndNoChannels) {
  constexpr std::size_t kEvents = EventTable::kMaxEvents / 2;
  constexpr std::size_t kChannels = PLC_MAX_CHANNELS / 2 + 1;
  for (int version = 0; version < 3; ++version) {
    ApplicationDeclaration refused;
    host_.begin_init(refused);
    RTS_RESULT result = ERR_FAILED;
    for (std::size_t i = 0; i < kEvents; ++i) {
      (void)SchedRegisterExternalEvent(fmt::format("event{}_{}", version, i).c_str(), &result);
      ASSERT_EQ(result, ERR_OK) << version << " " << i;
    }
    for (std::size_t i = 0; i < kChannels; ++i) {
      (void)plc_channel_open(fmt::format("channel{}_{}", version, i).c_str(), &result);
      ASSERT_EQ(result, ERR_OK) << version << " " << i;
    }
    host_.end_init();
    host_.end_version();
  }
}

TEST_F(OnlineDeclaration, ThatIsCommittedKeepsItsChannels) {
  host_.begin_init(online_);
  const RTS_HANDLE channel = plc_channel_open("values", nullptr);
  host_.end_init();
  host_.commit(std::move(online_), [](const void*) { return false; });
  host_.end_version();
  EXPECT_EQ(plc_channel_open("values", nullptr), channel);
  EXPECT_NE(plc_channel_open("others", nullptr), channel);
}

class OnlineDeclarationInAPool : public ::testing::Test {
 protected:
  OnlineDeclarationInAPool() {
    host_.commit({}, [](const void*) { return false; });
  }
  ~OnlineDeclarationInAPool() override { ObjectPool::remove(name_); }

  std::string name_ = own_name("online");
  ObjectPool pool_ = ObjectPool::create(name_).value();
  ApplicationHost host_{"test", &pool_};
  ApplicationDeclaration online_;
};

TEST_F(OnlineDeclarationInAPool, ThatIsRefusedPostsNothingByItsHandles) {
  for (const char* name : {"first", "first", "second"}) {
    host_.begin_init(online_);
    const RTS_HANDLE event = SchedRegisterExternalEvent(name, nullptr);
    EXPECT_EQ(SchedPostExternalEvent(event), ERR_NO_OBJECT) << "it is not registered before the commit";
    host_.end_init();
    online_ = {};
    host_.end_version();
    EXPECT_EQ(SchedPostExternalEvent(event), ERR_PARAMETER);
    EXPECT_EQ(CAL_SysEventSet(event), ERR_PARAMETER);
  }
}

TEST_F(OnlineDeclarationInAPool, ThatIsRefusedClosesTheChannelsThatOnlyItHasOpened) {
  const RTS_HANDLE of_running = plc_channel_open("running", nullptr);
  host_.begin_init(online_);
  EXPECT_EQ(plc_channel_open("running", nullptr), of_running);
  const RTS_HANDLE channel = plc_channel_open("values", nullptr);
  const int value = 1;
  const unsigned to = plc_node_address(nullptr);
  EXPECT_NE(plc_channel_send(channel, to, PLC_BLOCK_LOW, &value, sizeof value), ERR_PARAMETER);
  host_.end_init();
  host_.end_version();
  EXPECT_EQ(plc_channel_send(channel, to, PLC_BLOCK_LOW, &value, sizeof value), ERR_PARAMETER);
  EXPECT_NE(plc_channel_send(of_running, to, PLC_BLOCK_LOW, &value, sizeof value), ERR_PARAMETER);
  EXPECT_EQ(plc_channel_open("values", nullptr), channel) << "its place is free again";
  EXPECT_NE(plc_channel_send(channel, to, PLC_BLOCK_LOW, &value, sizeof value), ERR_PARAMETER);
}

TEST_F(OnlineDeclaration, OfTasksAndOptionsDoesNotReachTheOnesThatRun) {
  host_.begin_init(online_);
  sys_setup_tasks_struct other{};
  __sys__setup__tasks(&other);
  Task_Options options{};
  options.dwSize = sizeof options;
  EXPECT_EQ(plc_set_task_options("Main", &options), ERR_OK);
  EXPECT_EQ(plc_set_task_options("Main", &options), ERR_DUPLICATE);
  EXPECT_EQ(SchedSetTaskInterval(RTS_INVALID_HANDLE, 1'000'000), ERR_NOTINITIALIZED);
  host_.end_init();
  EXPECT_EQ(host_.declaration().tasks, &setup_);
  EXPECT_FALSE(host_.declaration().tasks_given_twice);
  EXPECT_THAT(host_.declaration().task_options, IsEmpty());
  EXPECT_EQ(online_.tasks, &other);
  EXPECT_EQ(online_.task_options.size(), 1U);
}

TEST_F(OnlineDeclaration, CallbacksInTheCodeThatGoesAreForgottenWhoeverRegisteredThem) {
  host_.commit({}, [](const void* code) { return code == std::bit_cast<const void*>(&callback); });
  notify();
  EXPECT_EQ(calls_component_, 0);
}

}  // namespace
}  // namespace plchost
