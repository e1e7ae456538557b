// The table of operations and the words of error codes against the contract, which the build reads from
// control.idl.
#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <code_words.hpp>
#include <contract_operations.hpp>
#include <gtest/gtest.h>

#include "api/plchost_client.hpp"
#include "api/server/access/request_check.hpp"
#include "api/server/manager_link.hpp"
#include "shm/base/stop_limits.hpp"
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

TEST(OperationTable, HasHelpForEachCommandOfAClient) {
  for (const Operation& operation : operations()) {
    const bool is_command = operation.place != OperationPlace::internal && !operation.only_reads;
    EXPECT_EQ(is_command, *operation.help != '\0') << operation.name;
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
  EXPECT_EQ(operation_of(ControlVerb::stop).limit, kStopLimit);
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

// Of the contract, of the host's texts, of the client library.
TEST(ErrorCodes, HaveOneWordEverywhere) {
#define OF_CLIENT(word) std::pair(ClientError::word, std::string_view(#word))
  constexpr std::array kOfClient{
      OF_CLIENT(invalid_argument), OF_CLIENT(not_found),   OF_CLIENT(already_exists), OF_CLIENT(wrong_state),
      OF_CLIENT(refused),          OF_CLIENT(busy),        OF_CLIENT(timed_out),      OF_CLIENT(unavailable),
      OF_CLIENT(failed),           OF_CLIENT(unsupported), OF_CLIENT(full),           OF_CLIENT(corrupt),
      OF_CLIENT(wrong_type),       OF_CLIENT(wrong_size)};
#undef OF_CLIENT
  const auto& words = dds::words::Reply::code;
  ASSERT_EQ(words.size(), kOfClient.size() + 1);
  EXPECT_EQ(to_string(static_cast<ErrorCode>(words.size())), "unknown") << "the contract has all of them";
  for (std::size_t code = 0; code < words.size(); ++code) {
    std::string own(to_string(static_cast<ErrorCode>(code)));
    std::ranges::replace(own, ' ', '_');
    EXPECT_EQ(own, words[code]);
    if (code == 0) continue;
    EXPECT_EQ(static_cast<std::size_t>(kOfClient[code - 1].first), code);
    EXPECT_EQ(kOfClient[code - 1].second, words[code]);
  }
}

TEST(OperationTable, SaysWhatWasDone) {
  EXPECT_EQ(done_text(operation_of(ControlVerb::start), ""), "started");
  EXPECT_EQ(done_text(operation_of(ControlVerb::register_event), "ready"), "event ready is registered");
}

}  // namespace
}  // namespace plchost
