#include <gmock/gmock.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/progress_board.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/table.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/text.hpp"

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
  EXPECT_EQ(format_table(rows, columns, true),
            "STATE    NAME\n"
            "\x1b[32mrunning\x1b[0m  running\n"
            "\x1b[31mfailed\x1b[0m   b\n");
  EXPECT_THAT(format_table(rows, columns), testing::Not(HasSubstr("\x1b")));
}

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
  EXPECT_EQ(row["state"], "9") << "what a newer host may say is shown as its number";
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
  options.domain = dds::kMaxDomain + 1;
  EXPECT_FALSE(dds::domain_configuration(dds::Role::client, options));
  options.domain = dds::kMaxDomain;
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
