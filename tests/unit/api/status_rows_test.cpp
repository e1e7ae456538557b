// Rows, columns and order of status topics as the build makes them from control.idl.
#include "api/cli/rows/status_rows.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "api/cli/rows/host_rows.hpp"
#include "api/client/status_count.hpp"
#include "api/control/host_finding.hpp"
#include "api/dds/code_names.hpp"
#include "api/dds/text.hpp"
#include "schedulers/distributed_clock/distributed_clock.hpp"
#include "shm/base/fault_record.hpp"
#include "shm/base/task_kind.hpp"
#include "shm/log/log_line.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/log_ring.hpp"
#include "shm/pages/transition_ring.hpp"
#include "shm/pool/pool_layout.hpp"

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

TEST(StatusRows, OfAnExceptionSayWhatWasStopped) {
  plc_ExceptionStatus exception{};
  dds::copy_text(exception.host, "hosta");
  dds::copy_text(exception.instance, "line1");
  EXPECT_EQ(
      json_text(to_row(exception)),
      R"({"host":"hosta","instance":"line1","count":0,"present":false,"time":"","time_unix_ns":0,)"
      R"("task":"","stopped":"","kind":"none","signal":"","text":"","address":0,"symbol":"",)"
      R"("memory_address":0,"application":"","back_trace":"","back_trace_end":"","activity":"",)"
      R"("version":"","build":"","build_id":"","scheduler":"","settings":"","cycles":0,"uptime_us":null})");
  exception.count = 1;
  EXPECT_EQ(to_row(exception).at("stopped"), "task");
  exception.whole_application = true;
  EXPECT_EQ(to_row(exception).at("stopped"), "application");
}

TEST(StatusRows, OfATransitionHaveTheStatesOfWhatChanged) {
  plc_Transition transition{};
  dds::copy_text(transition.host, "hosta");
  dds::copy_text(transition.instance, "line1");
  dds::copy_text(transition.reason, "start");
  transition.sequence_number = 7;
  transition.time_unix_ns = 1'000'000'000;
  transition.time_monotonic_ns = 5;
  transition.from_state = 1;
  transition.to_state = 2;
  transition.pid = 12;
  EXPECT_EQ(json_text(to_row(transition)),
            R"({"host":"hosta","instance":"line1","sequence":7,"time":"1970-01-01T00:00:01.000Z",)"
            R"("of":"application","from":"stopped","to":"running","pid":12,"time_unix_ns":1000000000,)"
            R"("time_monotonic_ns":5,"reason":"start"})");
  transition.source = 1;
  EXPECT_EQ(to_row(transition).at("of"), "process");
  EXPECT_EQ(to_row(transition).at("from"), "starting");
}

TEST(StatusRows, OfAnApplicationHaveWhatIsKnownOfASentFile) {
  plc_ApplicationStatus application{};
  dds::copy_text(application.host, "hosta");
  dds::copy_text(application.instance, "line1");
  dds::copy_text(application.path, "/opt/a.so");
  EXPECT_EQ(json_text(to_row(application, true)),
            R"({"host":"hosta","instance":"line1","version":null,"file":"/opt/a.so","size":null,"sent":"",)"
            R"("sent_unix_ns":0,"by":"","from":"","sha256":"","digest":"","loaded":"loaded","boot":"",)"
            R"("path":"/opt/a.so","before":""})")
      << "a file of the host, which nobody sent";
  application.version = 3;
  application.size = 100;
  application.boot = true;
  dds::copy_text(application.file_name, "a.so");
  dds::copy_text(application.sha256, "0123456789abcdef");
  const Row row = to_row(application, false);
  EXPECT_EQ(row.at("version"), 3);
  EXPECT_EQ(row.at("file"), "a.so");
  EXPECT_EQ(row.at("size"), 100);
  EXPECT_EQ(row.at("digest"), "0123456789ab");
  EXPECT_EQ(row.at("loaded"), "");
  EXPECT_EQ(row.at("boot"), "boot");
}

TEST(StatusRows, OfAHostHaveWhatItsStatusSaysAndWhatIsKnownBesideIt) {
  HostView host{.name = "hosta", .epoch = 1, .server_pid = 11, .status = {}, .ext = {}};
  dds::copy_text(host.status.host, "hosta");
  dds::copy_text(host.status.labels, "hall=2");
  dds::copy_text(host.status.counts[0].topic, "instance");
  host.status.counts[0].samples = 3;
  host.status.started_unix_ns = 2'000'000'000;
  host.status.load_percent = 150;
  const ClockOffset clock{.offset = Duration(2'000), .uncertainty = Duration(500)};
  Row row = to_row(host, clock);
  EXPECT_GT(row["uptime_s"], 0);
  row.erase("uptime_s");
  EXPECT_EQ(
      json_text(row),
      R"({"host":"hosta","state":"alive","version":"","started_unix_s":2,"running":0,"instances":3,)"
      R"("tasks":0,"events":0,"objects":0,"load":1.5,"cores":null,"memory_mib":null,)"
      R"("available_mib":null,"clock_offset_us":2.0,"clock_uncertainty_us":0.5,"grid_reference":null,)"
      R"("grid_offset_us":null,"grid_in_sync":null,"secured":false,)"
      R"("manager_pid":0,"server_pid":11,"problem":"","labels":"hall=2","schedulers":"","audit_number":0,)"
      R"("audit_hash":"","unrecorded":"","rival":"","unsaved":""})");
  host.silent = true;
  host.status.load_percent = -1;
  dds::copy_text(host.status.rival, "hostb");
  row = to_row(host, std::nullopt);
  EXPECT_EQ(row.at("state"), "silent");
  EXPECT_TRUE(row.at("uptime_s").is_null());
  EXPECT_TRUE(row.at("load").is_null());
  EXPECT_TRUE(row.at("clock_offset_us").is_null());
  EXPECT_EQ(row.at("problem"), "another host wants this name and is refused: hostb");
}

TEST(StatusRows, OfAHostTellHowFarItsCyclesAreFromTheClockThatTheyFollow) {
  HostView host{.name = "hosta", .epoch = 1, .server_pid = 11, .status = {}, .ext = {}};
  host.status.grid_instances = 2;
  host.status.grid_in_sync = 1;
  host.status.grid_offset_ns = -1'300;
  dds::copy_text(host.status.grid_reference, "ptp:/dev/ptp0");
  Row row = to_row(host, std::nullopt);
  EXPECT_TRUE(row.at("grid_offset_us").is_null()) << "none has measured it";
  EXPECT_EQ(row.at("grid_in_sync"), false);
  host.status.grid_measured = 1;
  row = to_row(host, std::nullopt);
  EXPECT_EQ(row.at("grid_reference"), "ptp:/dev/ptp0");
  EXPECT_EQ(row.at("grid_offset_us"), -1.3);
  EXPECT_EQ(row.at("grid_in_sync"), false);
  host.status.grid_in_sync = 2;
  host.status.grid_offset_ns = 0;
  row = to_row(host, std::nullopt);
  EXPECT_EQ(row.at("grid_offset_us"), 0.0);
  EXPECT_EQ(row.at("grid_in_sync"), true);
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
  const auto& columns = columns_of<plc_HostFinding>();  // none by hand
  ASSERT_EQ(columns.size(), 7U);
  EXPECT_STREQ(columns[1].field, "id");
  EXPECT_STREQ(columns[1].header, "ID");
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
  for (const Column& column : columns_of<plc_Transition>()) {
    EXPECT_TRUE(to_row(plc_Transition{}).contains(column.field)) << column.field;
  }
  for (const Column& column : columns_of<plc_ApplicationStatus>()) {
    EXPECT_TRUE(to_row(plc_ApplicationStatus{}, false).contains(column.field)) << column.field;
  }
  for (const Column& column : columns_of<plc_HostStatus>()) {
    EXPECT_TRUE(to_row(HostView{}, std::nullopt).contains(column.field)) << column.field;
  }
}

TEST(StatusWords, AreThoseOfTheContract) {
  std::vector<std::string> states;
  for (std::uint32_t state = 0; state <= 9; ++state) states.push_back(dds::instance_state_name(state));
  EXPECT_THAT(states, testing::ElementsAre("offline", "starting", "running", "stopped", "stopping", "waiting",
                                           "safe_mode", "failed", "exception", "9"));
  EXPECT_EQ(dds::word_for(dds::words::TaskStatus::state, 0), "created");
  EXPECT_EQ(dds::log_level_name(1), "info");
  EXPECT_EQ(dds::log_source_name(2), "output");
  EXPECT_EQ(dds::transition_state_name(0, 3), "single_cycle");
  EXPECT_EQ(dds::transition_state_name(1, 6), "safe_mode");
  EXPECT_EQ(dds::finding_level_name(3), "problem");
}

/// "running", as the code of the program calls it; "(plchost::InstanceState)9" if it has no name.
template <auto kValue>
std::string name_of() {
  std::string_view text = __PRETTY_FUNCTION__;
  text = text.substr(text.find("kValue = ") + std::string_view("kValue = ").size());
  text = text.substr(0, text.find_first_of(";]"));
  const auto colons = text.starts_with('(') ? std::string_view::npos : text.rfind("::");
  return std::string(colons == std::string_view::npos ? text : text.substr(colons + 2));
}

template <class Code, std::size_t... kIndex>
std::vector<std::string> names_of(std::index_sequence<kIndex...> /*codes*/) {
  return {name_of<static_cast<Code>(kIndex)>()...};
}

/// Each word is the name of the enumerator of that number, and there is no further one.
template <class Code, std::size_t kSize>
void expect_names(const std::array<std::string_view, kSize>& words) {
  std::vector<std::string> wanted(words.begin(), words.end());
  for (std::string& word : wanted) std::ranges::replace(word, '-', '_');
  EXPECT_THAT(names_of<Code>(std::make_index_sequence<kSize>()), testing::ElementsAreArray(wanted));
  EXPECT_TRUE(name_of<static_cast<Code>(kSize)>().starts_with('('))
      << "the contract has no word for " << name_of<static_cast<Code>(kSize)>();
}

TEST(StatusWords, AreTheNamesOfTheCodesInThePrograms) {
  expect_names<InstanceState>(dds::words::InstanceStatus::state);
  expect_names<RestartPolicy>(dds::words::InstanceStatus::restart_policy);
  expect_names<ClockState>(dds::words::InstanceStatus::clock_state);
  expect_names<PageTaskState>(dds::words::TaskStatus::state);
  expect_names<ApplicationState>(dds::words::Transition::from_state);
  expect_names<TransitionSource>(dds::words::Transition::source);
  expect_names<LogLevel>(dds::words::LogRecord::level);
  expect_names<LogSource>(dds::words::LogRecord::source);
  expect_names<FindingLevel>(dds::words::HostFinding::level);
}

/// A state has in logs and errors of the programs the word of the contract, as people write it.
template <class Code, std::size_t kSize>
void expect_texts(const std::array<std::string_view, kSize>& words) {
  for (std::size_t code = 0; code < kSize; ++code) {
    std::string word(words[code]);
    std::ranges::replace(word, '_', ' ');
    EXPECT_EQ(to_string(static_cast<Code>(code)), word);
  }
}

TEST(StatusWords, AreTheTextsOfTheStatesInThePrograms) {
  expect_texts<InstanceState>(dds::words::InstanceStatus::state);
  expect_texts<PageTaskState>(dds::words::TaskStatus::state);
  expect_texts<ApplicationState>(dds::words::Transition::from_state);
}

TEST(StatusWords, OfTheKindsOfTasksAreThoseOfTheirTable) {
  for (const TaskKindTraits& kind : kTaskKinds)
    EXPECT_EQ(dds::word_for(dds::words::TaskStatus::kind, std::to_underlying(kind.kind)), kind.name);
  EXPECT_EQ(dds::words::TaskStatus::kind.size(), kTaskKinds.size())
      << "the contract names a kind that is not in the table";
}

TEST(StatusWords, OfTheTypesOfObjectsAreThoseOfTheirTable) {
  const auto word = [](std::uint32_t type) { return dds::word_for(dds::words::ObjectRecord::type, type); };
  for (const ObjectTraits& traits : kObjectTraits)
    EXPECT_EQ(word(std::to_underlying(traits.type)), traits.name);
  EXPECT_EQ(word(kObjectTypes), std::to_string(kObjectTypes))
      << "the contract names a type that is not in the table";
}

TEST(StatusWords, OfTheKindsOfExceptionsAreThoseOfTheirRecords) {
  const auto& words = dds::words::ExceptionStatus::kind;
  for (std::uint32_t code = 1; code < words.size(); ++code)
    EXPECT_EQ(words.at(code), to_string(static_cast<FaultKind>(code - 1)));
  EXPECT_EQ(to_string(static_cast<FaultKind>(words.size() - 1)), "unknown")
      << "the contract has no word for it";
  EXPECT_EQ(dds::code_for(words, "stop_timeout"), 7U);
  EXPECT_EQ(dds::code_for(words, ""), 0U);
  EXPECT_EQ(dds::code_for(words, "none of them"), 0U);
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
