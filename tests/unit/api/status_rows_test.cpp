// Rows, columns and order of status topics as the build makes them from control.idl.
#include "api/cli/rows/status_rows.hpp"

#include <gmock/gmock.h>

#include "api/client/status_count.hpp"
#include "api/dds/code_names.hpp"
#include "api/dds/text.hpp"

namespace plchost {
namespace {

TEST(StatusRows, HaveTheMembersInTheirOrder) {
  plc_EventStatus event{};
  dds::copy_text(event.host, "hosta");
  dds::copy_text(event.instance, "line1");
  dds::copy_text(event.event, "ready");
  event.epoch = 7;
  event.registered = true;
  event.bound_tasks = 2;
  event.posts = 1'000'000'000'000;
  EXPECT_EQ(json_text(to_row(event)),
            R"({"host":"hosta","instance":"line1","event":"ready","registered":true,"bound_tasks":2,)"
            R"("posts":1000000000000})");
}

TEST(StatusRows, HaveDurationsInMicrosecondsAndCodesAsWords) {
  plc_TaskStatus task{};
  task.kind = 2;
  task.state = 99;  // of a newer host
  task.interval_ns = 1'500;
  const Row row = to_row(task);
  EXPECT_EQ(row.at("interval_us"), 1.5);
  EXPECT_EQ(row.at("kind"), "external");
  EXPECT_EQ(row.at("state"), "99");
  EXPECT_FALSE(row.contains("interval_ns"));
}

TEST(StatusRows, HaveTimesAsTextAndNumberAndGuidsAsDigits) {
  plc_WriterStatus writer{};
  writer.source[0] = 0xab;
  writer.last_unix_ns = 1'000'000'000;
  const Row row = to_row<plc_WriterStatus>(writer);
  EXPECT_EQ(row.at("last"), "1970-01-01T00:00:01.000Z");
  EXPECT_EQ(row.at("last_unix_ns"), 1'000'000'000);
  EXPECT_EQ(row.at("writer"), "ab000000000000000000000000000000")
      << "by the name that control.idl gives rows";
  EXPECT_EQ(to_row(plc_WriterStatus{}).at("writer"), "all");
}

TEST(StatusRows, ShowWhatTheirExtensionHas) {
  std::array<plc_KeyValue, 1> ext{};
  dds::copy_text(ext[0].name, "colour");
  dds::copy_text(ext[0].value, "5");
  plc_EventStatus event{};
  event.ext._buffer = ext.data();
  event.ext._length = 1;
  EXPECT_EQ(to_row(event).at("colour"), 5);
}

TEST(StatusRows, HaveAColumnForEachMember) {
  const auto& columns = columns_of<plc_ObjectStatus>();  // none by hand
  ASSERT_EQ(columns.size(), 4U);
  EXPECT_STREQ(columns[1].field, "object_name");
  EXPECT_STREQ(columns[1].header, "OBJECT-NAME");
  EXPECT_EQ(columns[1].rank, 0) << "a key is never left out";
  EXPECT_GT(columns[3].rank, columns[2].rank);
}

TEST(StatusRows, HaveTheColumnsThatTheContractNames) {
  const auto& columns = columns_of<plc_InstanceStatus>();
  ASSERT_EQ(columns.size(), 9U);
  EXPECT_STREQ(columns[1].field, "name");
  EXPECT_STREQ(columns[1].header, "NAME");
  EXPECT_EQ(columns[4].rank, 3);
  EXPECT_EQ(columns[4].none, -1);
  const auto& of_tasks = columns_of<plc_TaskStatus>();
  const auto interval = std::ranges::find(of_tasks, std::string_view("interval_us"), &Column::field);
  ASSERT_NE(interval, of_tasks.end());
  EXPECT_STREQ(interval->header, "INTERVAL(us)");
  EXPECT_EQ(interval->decimals, 0);
  for (const Column& column : of_tasks) EXPECT_TRUE(to_row(plc_TaskStatus{}).contains(column.field));
  for (const Column& column : columns_of<plc_ExceptionStatus>()) {
    EXPECT_TRUE(to_row(plc_ExceptionStatus{}).contains(column.field)) << column.field;
  }
}

TEST(StatusWords, AreThoseOfTheContract) {
  std::vector<std::string> states;
  for (std::uint32_t state = 0; state <= 9; ++state) states.push_back(dds::instance_state_name(state));
  EXPECT_THAT(states, testing::ElementsAre("offline", "starting", "running", "stopped", "stopping", "waiting",
                                           "safe_mode", "failed", "exception", "9"));
  EXPECT_EQ(dds::task_kind_name(3), "freewheeling");
  EXPECT_EQ(dds::task_state_name(0), "created");
}

TEST(StatusOrder, IsThatOfTheContract) {
  plc_TaskStatus first{};
  plc_TaskStatus second{};
  dds::copy_text(first.task, "Zeta");
  dds::copy_text(second.task, "Alpha");
  second.priority = 1;
  EXPECT_LT(dds::order_of(first), dds::order_of(second)) << "by priority before the name";
}

TEST(StatusCount, IsThatOfTheTopic) {
  plc_HostStatus host{};
  dds::copy_text(host.counts[0].topic, "instance");
  host.counts[0].samples = 3;
  EXPECT_EQ(count_of<plc_InstanceStatus>(host), 3U);
  EXPECT_EQ(count_of<plc_TaskStatus>(host), std::nullopt) << "an older host does not know that topic";
}

}  // namespace
}  // namespace plchost
