#include <algorithm>
#include <array>

#include <gmock/gmock.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/progress_board.hpp"
#include "api/cli/rows/host_rows.hpp"
#include "api/cli/rows/node_rows.hpp"
#include "api/cli/rows/object_rows.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/cli/rows/table.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/text.hpp"
#include "shm/pages/host_words.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

TEST(Table, AlignsTextsToTheLeftAndNumbersToTheRight) {
  const std::vector<Row> rows{{{"name", "a"}, {"value", 5}}, {{"name", "long"}, {"value", 1000}}};
  EXPECT_EQ(format_table(rows, {{"name", "NAME"}, {"value", "V"}}),
            "NAME     V\n"
            "a        5\n"
            "long  1000\n");
}

TEST(Table, ShowsNothingAsADashAndFractionsAsAsked) {
  const std::vector<Row> rows{{{"name", ""}, {"value", 1.25}}};
  EXPECT_EQ(format_table(rows, {{"name", "NAME"}, {"value", "V", 1}}), "NAME    V\n-     1.2\n");
}

TEST(Table, CountsCharactersAndNotBytes) {
  EXPECT_EQ(format_table({{{"name", "F\u00fclldruck"}, {"value", "a"}}, {{"name", "plain"}, {"value", "b"}}},
                         {{"name", "NAME"}, {"value", "V"}}),
            "NAME       V\n"
            "F\u00fclldruck  a\n"
            "plain      b\n");
}

TEST(Table, LetsNoNameDriveTheTerminal) {
  EXPECT_THAT(format_table({{{"name", "a\x1b[2J"}}}, {{"name", "NAME"}}), testing::Not(HasSubstr("\x1b")));
}

TEST(Fields, LetNoNameDriveTheTerminal) {
  Row row;
  row["a\x1b[2J"] = "b";
  EXPECT_THAT(format_fields(row), testing::Not(HasSubstr("\x1b")));
}

TEST(Failure, LetsNoTextOfAHostDriveTheTerminal) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(CliSession::fail({ErrorCode::refused, 0, "no\x1b]0;title\x07"}), kExitFailed);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "plcctl: no?]0;title?\n");
}

TEST(Table, ColoursStatesOnlyWhereItIsAskedTo) {
  const std::vector<Row> rows{{{"state", "running"}, {"name", "running"}},
                              {{"state", "failed"}, {"name", "b"}}};
  const std::vector<Column> columns{{"state", "STATE"}, {"name", "NAME"}};
  EXPECT_EQ(format_table(rows, columns, {.coloured = true}),
            "STATE    NAME\n"
            "\x1b[32mrunning\x1b[0m  running\n"
            "\x1b[31mfailed\x1b[0m   b\n");
  EXPECT_THAT(format_table(rows, columns), testing::Not(HasSubstr("\x1b")));
}

std::vector<Row> two_instances() {
  return {{{"name", "b"}, {"pid", 0}, {"text", "long text"}}, {{"name", "a"}, {"pid", 12}, {"text", ""}}};
}
const std::vector<Column> kThreeColumns{{.field = "name", .header = "NAME"},
                                        {.field = "pid", .header = "PID", .rank = 1, .none = 0},
                                        {.field = "text", .header = "TEXT", .rank = 2}};

TEST(Table, LeavesColumnsOutByTheirRankUntilItFits) {
  EXPECT_EQ(format_table(two_instances(), kThreeColumns, {.width = 20}),
            "NAME  PID  TEXT\nb       -  long text\na      12  -\n");
  EXPECT_EQ(format_table(two_instances(), kThreeColumns, {.width = 19}), "NAME  PID\nb       -\na      12\n");
  EXPECT_EQ(format_table(two_instances(), kThreeColumns, {.width = 5}), "NAME\nb\na\n");
}

TEST(Table, ShowsTheColumnsThatAreAskedFor) {
  const auto rows = two_instances();
  const auto chosen = choose_columns({"text", "pid"}, rows, kThreeColumns);
  ASSERT_TRUE(chosen);
  EXPECT_EQ(format_table(rows, *chosen, {.width = 5}), "TEXT       PID\nlong text    -\n-           12\n");
  const auto unknown = choose_columns({"pdi"}, rows, kThreeColumns);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().message, "there is no column 'pdi'; there are name, pid, text");
}

TEST(Table, IsSortedByNumbersAndTextsInBothDirections) {
  auto rows = two_instances();
  ASSERT_TRUE(sort_rows(rows, "name"));
  EXPECT_EQ(rows[0]["name"], "a");
  ASSERT_TRUE(sort_rows(rows, "pid"));
  EXPECT_EQ(rows[0]["pid"], 0);
  ASSERT_TRUE(sort_rows(rows, "-pid"));
  EXPECT_EQ(rows[0]["pid"], 12);
  EXPECT_EQ(sort_rows(rows, "size").error().code, ErrorCode::invalid_argument);
}

class EveryTable : public testing::TestWithParam<const std::vector<Column>*> {};

TEST_P(EveryTable, FitsIntoATerminalOf80CharactersByItsRanks) {
  constexpr std::size_t kWidth = 80;
  Row row;
  for (const Column& column : *GetParam()) row[column.field] = "ten letters";
  const std::string table = format_table({row}, *GetParam(), {.width = kWidth});
  EXPECT_LE(table.find('\n'), kWidth) << table;
  const auto kept = std::ranges::count(*GetParam(), 0, &Column::rank);
  EXPECT_GE(kept, 2) << "a table that tells nothing fits, too";
}

INSTANTIATE_TEST_SUITE_P(All, EveryTable,
                         testing::Values(&columns_of<plc_InstanceStatus>(), &columns_of<plc_TaskStatus>(),
                                         &columns_of<plc_EventStatus>(), &columns_of<plc_WriterStatus>(),
                                         &columns_of<plc_ExceptionStatus>(), &columns_of<plc_Transition>(),
                                         &columns_of<plc_ApplicationStatus>(), &columns_of<plc_HostStatus>(),
                                         &columns_of<plc_NodeRecord>(), &columns_of<plc_RouteRecord>(),
                                         &object_columns()));

TEST(Csv, QuotesWhatWouldBeTwoFields) {
  EXPECT_EQ(format_csv({}), "");
  EXPECT_EQ(format_csv({{{"name", "a,b"}, {"text", "he said \"no\""}, {"n", 1.5}},
                        {{"n", nullptr}, {"name", "two\nlines"}, {"more", "is not shown"}}}),
            "name,text,n\n"
            "\"a,b\",\"he said \"\"no\"\"\",1.5\n"
            "two?lines,,\n");
  EXPECT_EQ(format_csv({{{"name", "a\xff\x1b[2J"}}}), "name\na??[2J\n") << "no file is spoiled by a name";
}

TEST(Json, IsAnArrayOfFlatObjects) {
  EXPECT_EQ(format_json({}), "[]\n");
  EXPECT_EQ(format_json({{{"b", 1}, {"a", "x"}}}), "[\n  {\"b\":1,\"a\":\"x\"}\n]\n");
}

TEST(Json, HasNoControlCharacters) {
  const Row row{{"name", "F\u00fcll\x1b\x7f\u009b2J"}};
  EXPECT_EQ(json_text(row), "{\"name\":\"F\u00fcll\\u001b\\u007f\\u009b2J\"}");
  EXPECT_EQ(Row::parse(json_text(row)), row);
}

TEST(Rows, GiveDurationsInMicroseconds) {
  plc_TaskStatus status{};
  dds::copy_text(status.task, "Main");
  status.interval_ns = 1'500;
  status.kind = 2;
  status.state = 9;
  const Row row = to_row(status);
  EXPECT_EQ(row["interval_us"], 1.5);
  EXPECT_EQ(row["kind"], "external");
  EXPECT_EQ(row["state"], "9") << "an unknown code of a newer host is shown as its number";
}

TEST(Rows, GiveWholeNumbersOfAHostAsNumbers) {
  std::array<plc_KeyValue, 3> entries{};
  const std::array<std::array<const char*, 2>, 3> said{{{"a", "-12"}, {"b", "007"}, {"c", "1 of 2"}}};
  for (std::size_t i = 0; i < said.size(); ++i) {
    dds::copy_text(entries[i].name, said[i][0]);
    dds::copy_text(entries[i].value, said[i][1]);
  }
  Row row = Row::object();
  add_extension(row, entries);
  EXPECT_EQ(json_text(row), R"({"a":-12,"b":"007","c":"1 of 2"})");
}

TEST(Rows, GiveTimesInUtcToTheMillisecond) {
  EXPECT_EQ(time_text(1'789'000'000'123'987'654), "2026-09-10T00:26:40.123Z");
  EXPECT_EQ(time_text(1'789'000'000'000'000'000), "2026-09-10T00:26:40.000Z");
  EXPECT_EQ(time_text(0), "") << "it has not happened";
}

TEST(SplitName, SplitsAtTheFirstSlash) {
  EXPECT_EQ(split_name("TASK", "a/b/c").value(), (std::pair<std::string, std::string>("a", "b/c")));
  for (const char* wrong : {"", "a", "/a", "a/"}) EXPECT_FALSE(split_name("TASK", wrong)) << wrong;
}

TEST(DomainConfiguration, LetsNoOptionIntoTheXml) {
  dds::DomainOptions options;
  options.interfaces = {"lo\"/><x"};
  EXPECT_FALSE(dds::domain_configuration(dds::Role::server, options));
  options.interfaces = {"lo"};
  options.peers = {"<x>"};
  EXPECT_FALSE(dds::domain_configuration(dds::Role::client, options));
  options.peers = {};
  options.domain = kMaxDdsDomain + 1;
  EXPECT_FALSE(dds::domain_configuration(dds::Role::client, options));
  options.domain = kMaxDdsDomain;
  EXPECT_TRUE(dds::domain_configuration(dds::Role::client, options));
}

TEST(DomainConfiguration, LooksForOthersByMulticastOnNetworksOnly) {
  dds::DomainOptions options;
  const auto configuration = [&] { return dds::domain_configuration(dds::Role::server, options).value(); };
  EXPECT_THAT(configuration(), HasSubstr("<AllowMulticast>false<"));
  EXPECT_THAT(configuration(), HasSubstr("<Peer Address=\"127.0.0.1\"/>"));
  options.interfaces = {"eth0"};
  EXPECT_THAT(configuration(), HasSubstr("<AllowMulticast>spdp<"));
  EXPECT_THAT(configuration(), testing::Not(HasSubstr("<Peer ")));
  options.multicast = false;
  options.peers = {"10.0.0.1"};
  EXPECT_THAT(configuration(), HasSubstr("<AllowMulticast>false<"));
  EXPECT_THAT(configuration(), HasSubstr("<Peer Address=\"10.0.0.1\"/>"));
  options.interfaces = {"lo"};
  options.multicast = true;
  EXPECT_THAT(configuration(), HasSubstr("<AllowMulticast>false<"));
}

TEST(DomainConfiguration, AnnouncesAClientOftenWhereANewServerCannotReachIt) {
  dds::DomainOptions options;
  const auto client = [&] { return dds::domain_configuration(dds::Role::client, options).value(); };
  EXPECT_THAT(client(), HasSubstr("<SPDPInterval>200 ms<"));
  EXPECT_THAT(dds::domain_configuration(dds::Role::server, options).value(),
              HasSubstr("<LeaseDuration>500 ms<"));
  options.interfaces = {"eth0"};
  EXPECT_THAT(client(), HasSubstr("<SPDPInterval>1 s<"));
  EXPECT_THAT(client(), HasSubstr("<LeaseDuration>3 s<"));
  options.multicast = false;
  EXPECT_THAT(client(), HasSubstr("<SPDPInterval>200 ms<"));
}

TEST(DomainConfiguration, AsksForRealTimeThreadsOnlyWhenTheyWereGranted) {
  dds::DomainOptions options;
  EXPECT_THAT(dds::domain_configuration(dds::Role::server, options).value(),
              testing::Not(HasSubstr("Realtime")));
  options.receive_fifo = 20;
  EXPECT_THAT(dds::domain_configuration(dds::Role::server, options).value(), HasSubstr("Realtime"));
}

TEST(ProgressLine, ShowsHowMuchHasArrived) {
  EXPECT_EQ(progress_line("cell1", 6, 0, 4 << 20U),
            "cell1   [                              ]   0 %  0.0 of 4.0 MiB");
  EXPECT_EQ(progress_line("cell1", 5, 1 << 20U, 4 << 20U),
            "cell1  [#######                       ]  25 %  1.0 of 4.0 MiB");
  EXPECT_EQ(progress_line("cell1", 5, 4 << 20U, 4 << 20U),
            "cell1  [##############################] 100 %  4.0 of 4.0 MiB, loading");
  EXPECT_EQ(progress_line("a", 1, 9, 4),
            "a  [##############################] 100 %  0.0 of 0.0 MiB, loading");
}

}  // namespace
}  // namespace plchost
