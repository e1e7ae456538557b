// The table of operations against the contract, which the build reads from control.idl.
#include <set>
#include <string>

#include <contract_operations.hpp>
#include <gtest/gtest.h>

#include "api/server/access/request_check.hpp"
#include "api/server/manager_link.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {
namespace {

TEST(OperationTable, HasEachOperationOfTheContractAsItIsThere) {
  for (const ContractOperation& told : kContractOperations) {
    SCOPED_TRACE(told.name);
    const Operation* const own = find_operation(told.number);
    ASSERT_NE(own, nullptr);
    EXPECT_EQ(own->name, told.name);
    EXPECT_EQ(request_topic(own->role).name, std::string("plc/v1/") + std::string(told.role) + "/request");
    EXPECT_EQ(own->names_instance, told.names_instance);
  }
}

TEST(OperationTable, HasNoOtherForClients) {
  std::size_t count = 0;
  for (const Operation& operation : operations())
    count += operation.place == OperationPlace::internal ? 0 : 1;
  EXPECT_EQ(count, kContractOperations.size());
}

TEST(OperationTable, NamesAndVerbsAreUnique) {
  std::set<std::string_view> names;
  std::set<ControlVerb> verbs;
  for (const Operation& operation : operations()) {
    EXPECT_TRUE(names.insert(operation.name).second) << operation.name;
    EXPECT_TRUE(verbs.insert(operation.verb).second) << operation.name;
    EXPECT_EQ(&operation_of(operation.verb), &operation);
  }
}

TEST(OperationTable, ShowsClientsNothingThatOnlyTheManagerAsks) {
  EXPECT_EQ(find_operation(static_cast<std::int32_t>(ControlVerb::shutdown)), nullptr);
  EXPECT_EQ(find_operation("shutdown"), nullptr);
  EXPECT_EQ(find_operation(0), nullptr);
  EXPECT_EQ(find_operation("make coffee"), nullptr);
}

TEST(OperationTable, OnlyWhatIsOfAHostOrReadsNamesNoInstance) {
  for (const Operation& operation : operations()) {
    if (operation.names_instance) continue;
    EXPECT_TRUE(operation.place == OperationPlace::host || operation.place == OperationPlace::server)
        << operation.name;
  }
}

TEST(OperationTable, HasTheTimeOfEachOperation) {
  using std::chrono::seconds;
  EXPECT_EQ(operation_of(ControlVerb::stop).limit, seconds(38));
  EXPECT_EQ(operation_of(ControlVerb::single_cycle).limit, seconds(28));
  EXPECT_EQ(operation_of(ControlVerb::change_application).limit, seconds(18));
  EXPECT_EQ(operation_of(ControlVerb::set_scheduler).limit, seconds(10));
}

TEST(OperationTable, ClientsWaitUntilTheServerHasAnswered) {
  EXPECT_GT(kLongCommand, ManagerLink::kCommandLimit);
  for (const Operation& operation : operations())
    EXPECT_LE(operation.limit, ManagerLink::kCommandLimit) << operation.name;
  EXPECT_EQ(least_wait(operation_of(ControlVerb::stop)), kLongCommand);
  EXPECT_EQ(least_wait(operation_of(ControlVerb::restart)), kLongCommand);
  EXPECT_EQ(least_wait(operation_of(ControlVerb::start)), Duration::zero());
}

TEST(OperationTable, SaysWhatWasDone) {
  EXPECT_EQ(done_text(operation_of(ControlVerb::start), ""), "started");
  EXPECT_EQ(done_text(operation_of(ControlVerb::register_event), "ready"), "event ready is registered");
}

}  // namespace
}  // namespace plchost
