// The calls of another version's plc_app_init while the first one runs: collected, and nothing else.
#include <array>
#include <bit>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/application/application_host.hpp"

namespace plchost {
namespace {

using ::testing::IsEmpty;

class KeptVariablesOf : public ::testing::Test {
 protected:
  KeptVariablesOf() { host_.begin_init(); }
  ApplicationHost host_{"test", nullptr};
  std::array<char, 8> bytes_{};
};

TEST_F(KeptVariablesOf, AnApplicationAreNamedInItsInit) {
  EXPECT_EQ(plc_keep_variables("a", bytes_.data(), 8, 3), ERR_OK);
  EXPECT_EQ(plc_keep_variables("a", bytes_.data(), 8, 3), ERR_DUPLICATE);
  host_.end_init();
  EXPECT_EQ(plc_keep_variables("b", bytes_.data(), 8, 3), ERR_NOTINITIALIZED);
  ASSERT_EQ(host_.declaration().variables.size(), 1U);
  const KeptVariables& kept = host_.declaration().variables.front();
  EXPECT_EQ(kept.name, "a");
  EXPECT_EQ(kept.address, bytes_.data());
  EXPECT_EQ(kept.bytes, 8U);
  EXPECT_EQ(kept.layout, 3U);
}

TEST_F(KeptVariablesOf, NoNameOrNoBytesAreRefused) {
  EXPECT_EQ(plc_keep_variables(nullptr, bytes_.data(), 8, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables("", bytes_.data(), 8, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables("a b", bytes_.data(), 8, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables(std::string(PLC_MAX_VARIABLE_NAME + 1, 'x').c_str(), bytes_.data(), 8, 0),
            ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables("a", nullptr, 8, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables("a", bytes_.data(), 0, 0), ERR_PARAMETER);
  EXPECT_EQ(plc_keep_variables(std::string(PLC_MAX_VARIABLE_NAME, 'x').c_str(), bytes_.data(), 8, 0), ERR_OK);
}

TEST_F(KeptVariablesOf, AnApplicationHaveABound) {
  EXPECT_EQ(plc_keep_variables("all", bytes_.data(), PLC_MAX_VARIABLE_BYTES, 0), ERR_OK);
  EXPECT_EQ(plc_keep_variables("one", bytes_.data(), 1, 0), ERR_NOMEMORY);
}

TEST_F(KeptVariablesOf, AnApplicationAreSoMany) {
  for (unsigned i = 0; i < PLC_MAX_VARIABLES; ++i) {
    ASSERT_EQ(plc_keep_variables(std::to_string(i).c_str(), bytes_.data(), 1, 0), ERR_OK);
  }
  EXPECT_EQ(plc_keep_variables("one", bytes_.data(), 1, 0), ERR_NOMEMORY);
}

void callback(unsigned /*event*/, const EVTPARAM_ExternalEventTask* /*parameter*/, void* user) {
  ++*static_cast<int*>(user);
}

class OnlineDeclaration : public ::testing::Test {
 protected:
  OnlineDeclaration() {
    host_.begin_init();
    before_ = SchedRegisterExternalEvent("before", nullptr);
    both_ = SchedRegisterExternalEvent("both", nullptr);
    EXPECT_EQ(EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, callback, &calls_before_),
              ERR_OK);
    host_.end_init();
    of_component_ = SchedRegisterExternalEvent("component", nullptr);
    EXPECT_EQ(EventRegisterCallbackFunction(EVT_ExternalEventTaskCreateDone, callback, &calls_component_),
              ERR_OK);
  }
  bool is_registered(RTS_HANDLE event) { return host_.events().is_by_application(event); }
  void notify() { host_.notify(EVT_ExternalEventTaskCreateDone, {}); }

  ApplicationHost host_{"test", nullptr};
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
  host_.begin_init(&online_);
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

  ASSERT_TRUE(host_.register_more(online_));
  EXPECT_TRUE(is_registered(after));
  host_.take_over(std::move(online_), [](const void*) { return false; });
  EXPECT_FALSE(is_registered(before_));
  EXPECT_TRUE(is_registered(both_));
  EXPECT_TRUE(is_registered(of_component_));
  notify();
  EXPECT_EQ(calls_before_, 1) << "of the version before";
  EXPECT_EQ(calls_after_, 1);
  EXPECT_EQ(calls_component_, 2);
}

TEST_F(OnlineDeclaration, ThatIsNotTakenLeavesAllAsItWas) {
  host_.begin_init(&online_);
  const RTS_HANDLE after = SchedRegisterExternalEvent("after", nullptr);
  host_.end_init();
  ASSERT_TRUE(host_.register_more(online_));
  host_.unregister_more(online_);
  EXPECT_FALSE(is_registered(after));
  EXPECT_TRUE(is_registered(before_));
  EXPECT_TRUE(is_registered(both_));
}

TEST_F(OnlineDeclaration, OfTasksAndOptionsDoesNotReachTheOnesThatRun) {
  sys_setup_tasks_struct setup{};
  Task_Info info{};
  setup.nTasks = 1;
  setup.ptaskinfo = &info;
  __sys__setup__tasks(&setup);
  host_.begin_init(&online_);
  sys_setup_tasks_struct other{};
  __sys__setup__tasks(&other);
  Task_Options options{};
  options.dwSize = sizeof options;
  EXPECT_EQ(plc_set_task_options("Main", &options), ERR_OK);
  EXPECT_EQ(plc_set_task_options("Main", &options), ERR_DUPLICATE);
  EXPECT_EQ(SchedSetTaskInterval(RTS_INVALID_HANDLE, 1'000'000), ERR_NOTINITIALIZED);
  host_.end_init();
  EXPECT_EQ(host_.declaration().tasks, &setup);
  EXPECT_FALSE(host_.declaration().tasks_given_twice);
  EXPECT_THAT(host_.declaration().task_options, IsEmpty());
  EXPECT_EQ(online_.tasks, &other);
  EXPECT_EQ(online_.task_options.size(), 1U);
}

TEST_F(OnlineDeclaration, CallbacksInTheCodeThatGoesAreForgottenWhoeverRegisteredThem) {
  host_.take_over({}, [](const void* code) { return code == std::bit_cast<const void*>(&callback); });
  notify();
  EXPECT_EQ(calls_component_, 0);
}

}  // namespace
}  // namespace plchost
