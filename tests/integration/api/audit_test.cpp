#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "tests/integration/api/test_host.hpp"
#include "tests/support/whole_lines.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Records = std::vector<nlohmann::json>;

class Audit : public testing::Test {
 protected:
  Audit() {
    host_.write_instance(0, "line1", InstanceState::running);
    host_.write_count(1);
    host_.start_server({"--audit-folder", folder_});
  }
  [[nodiscard]] RunResult run(std::vector<std::string> arguments) const {
    return run_plcctl(domain_.number(), std::move(arguments));
  }
  /// Of what was done, or with "/refused" of what was refused. `what`: of these only.
  [[nodiscard]] Records records(const std::string& what = "", const std::string& log = "") const {
    Records found;
    for (const std::string& line : whole_lines(folder_ + log + "/audit.0000000001.log")) {
      auto record = nlohmann::json::parse(line);
      if (what.empty() || record["what"] == what) found.push_back(std::move(record));
    }
    return found;
  }
  /// As soon as there are so many and none is under way: an answer waits 500 ms for the log, and no longer.
  [[nodiscard]] Records recorded(const std::string& what, std::size_t count) const {
    const auto are_there = [&] {
      std::error_code error;
      return records(what).size() >= count && std::filesystem::is_empty(folder_ + "/under_way", error);
    };
    for (const TimePoint end = soon(); !are_there() && MonotonicClock::now() < end;)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return records(what);
  }
  /// One whose disk hangs while the file `flag` is there.
  void replace_server_on_stuck_disk(const std::string& flag) {
    ::setenv("LD_PRELOAD", STUCK_DISK, 1);    // NOLINT(concurrency-mt-unsafe): the children have not started
    ::setenv("STUCK_DISK", flag.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
    host_.replace_server();
    ::unsetenv("LD_PRELOAD");  // NOLINT(concurrency-mt-unsafe)
    ::unsetenv("STUCK_DISK");  // NOLINT(concurrency-mt-unsafe)
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  std::string folder_ = host_.run_directory() + "/audit";
};

TEST_F(Audit, AnAcknowledgedChangeIsRecordedWithItsClient) {
  ASSERT_EQ(run({"stop", "instance", "line1"}).code, 0);
  const Records stops = recorded("stop", 1);
  ASSERT_EQ(stops.size(), 1U);
  EXPECT_EQ(stops[0]["on"], "line1");
  EXPECT_EQ(stops[0]["result"], "ok");
  EXPECT_THAT(
      stops[0]["from"].get<std::string>(),
      AllOf(HasSubstr("plcctl "), HasSubstr(", user " + std::to_string(::getuid())), HasSubstr("client ")));
}

TEST_F(Audit, ARefusedChangeIsRecordedWithTheReason) {
  const auto client = connect(domain_);
  const auto reply = client->call({"hosta", plc_OPERATION_LOAD_APPLICATION, "line1", "relative.so"}, soon());
  ASSERT_TRUE(reply) << reply.error().describe();
  // Not before the answer: no client has to rely on a refused change.
  const auto refused = [&] { return records("load application", "/refused"); };
  for (const TimePoint end = soon(); refused().empty() && MonotonicClock::now() < end;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(records("load application").empty());
  const Records loads = refused();
  ASSERT_EQ(loads.size(), 1U);
  EXPECT_EQ(loads[0]["argument"], "relative.so");
  EXPECT_EQ(loads[0]["result"], to_string(ErrorCode::invalid_argument));
  EXPECT_EQ(loads[0]["text"], reply->text);
}

TEST_F(Audit, WhatWasSentIsRecordedWithItsDigest) {
  const std::string file = host_.run_directory() + "/sent.so";
  std::ofstream(file) << "contents";
  ASSERT_EQ(run({"load", "application", "line1", file, "--boot"}).code, 0);
  const Records sent = recorded("download application", 1);
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0]["argument"],
            "sent.so sha256 d1b2a59fbea7e20077af9f91b27e95e865061b270be03ff539ab3b73587882e8 boot");
  EXPECT_EQ(sent[0]["result"], "ok");
}

TEST_F(Audit, LookingIsNotRecorded) {
  ASSERT_EQ(run({"list", "instances"}).code, 0);
  ASSERT_EQ(run({"list", "objects"}).code, 0);
  EXPECT_TRUE(records("list objects").empty());
}

TEST_F(Audit, PostsAreCountedForEachSource) {
  (void)host_.add_event("line1", "ready");
  ASSERT_EQ(run({"post", "event", "line1/ready", "--count", "5"}).code, 0);
  ASSERT_NE(run({"post", "event", "line1/unknown"}).code, 0);
  // A moment after the first of them was acknowledged: the sum so far. The ones after it are told a minute
  // later.
  const auto told = [&] {
    const Records posts = records("post");
    return std::ranges::any_of(posts, [](const auto& post) {
      const std::string text = post["text"];
      const std::string argument = post["argument"];
      return text.find(" taken and 0 refused") == 1 && text[0] >= '1' && text[0] <= '5' &&
             argument.starts_with("line1/ready ");
    });
  };
  for (const TimePoint end = soon(); !told() && MonotonicClock::now() < end;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(told());
}

// Opening the log hangs, as on a disk that is frozen.
TEST_F(Audit, ADiskThatHangsAtTheStartOfTheServerStopsNeitherPresenceNorPostsNorCommands) {
  (void)host_.add_event("line1", "ready");
  ASSERT_EQ(run({"stop", "instance", "line1"}).code, 0);
  ASSERT_EQ(recorded("stop", 1).size(), 1U);
  const std::string flag = host_.run_directory() + "/disk_hangs";
  std::ofstream(flag) << "hangs";
  replace_server_on_stuck_disk(flag);
  const auto client = connect(domain_);
  const std::vector operations{plc_OPERATION_STOP, plc_OPERATION_START, plc_OPERATION_RESET,
                               plc_OPERATION_START};
  for (const auto operation : operations) {
    const auto reply = client->call({"hosta", operation, "line1", ""}, soon());
    ASSERT_TRUE(reply) << reply.error().describe();
    EXPECT_EQ(reply->code, ErrorCode::ok);
    const auto posted = client->post_event({"hosta", "line1", "ready"}, 100, {}, kPatience);
    ASSERT_TRUE(posted) << posted.error().describe();
    EXPECT_EQ(posted->accepted, 100U);
  }
  std::string told;
  for (const TimePoint end = soon(); told.empty() && MonotonicClock::now() < end;) {
    const auto host = client->host("hosta", soon());
    ASSERT_TRUE(host) << host.error().describe();
    told = dds::text_of(host->status.unrecorded);
    client->wait_for_change(end);
  }
  EXPECT_THAT(told, HasSubstr("the log is not open yet"));
  EXPECT_THAT(run({"list", "hosts", "--json"}).output, HasSubstr("changes are not recorded: the disk"));
  EXPECT_TRUE(records("start").empty()) << "the disk did not hang: this test says nothing";
  std::filesystem::remove(flag);
  for (const TimePoint end = soon(); records("start").size() < 2 && MonotonicClock::now() < end;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::vector<std::string> found;
  for (const auto& record : records()) {
    if (record["on"] == "line1") found.push_back(record["what"]);
  }
  EXPECT_THAT(found, testing::ElementsAre("stop", "stop", "start", "reset", "start"));
  const RunResult whole = run({"verify", "audit", folder_});
  EXPECT_EQ(whole.code, 0) << whole.output;
}

// write() of the log hangs, as on a disk that is frozen.
TEST_F(Audit, ADiskThatHangsStopsNeitherPresenceNorPostsNorCommands) {
  (void)host_.add_event("line1", "ready");
  const std::string flag = host_.run_directory() + "/disk_hangs";
  replace_server_on_stuck_disk(flag);
  ASSERT_EQ(run({"stop", "instance", "line1"}).code, 0);
  const std::size_t before = recorded("stop", 1).size();
  std::ofstream(flag) << "hangs";
  const auto client = connect(domain_);
  const TimePoint begin = MonotonicClock::now();
  for (int i = 0; i < 3; ++i) {
    const auto reply = client->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon());
    ASSERT_TRUE(reply) << reply.error().describe();
    EXPECT_EQ(reply->code, ErrorCode::ok);
    const auto posted = client->post_event({"hosta", "line1", "ready"}, 100, {}, kPatience);
    ASSERT_TRUE(posted) << posted.error().describe();
    EXPECT_EQ(posted->accepted, 100U);
  }
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_EQ(records("stop").size(), before) << "the disk did not hang: this test says nothing";
  ASSERT_EQ(run({"list", "instances"}).code, 0);
  EXPECT_LT(MonotonicClock::now() - begin, kPatience);
  std::filesystem::remove(flag);
  EXPECT_EQ(recorded("stop", before + 3).size(), before + 3) << "waiting records are written then";
}

// The next one would be asked to do it again.
TEST_F(Audit, AServerThatIsAskedToEndAnswersWhatWasDoneAlsoWhileTheDiskHangs) {
  const std::string flag = host_.run_directory() + "/disk_hangs";
  replace_server_on_stuck_disk(flag);
  const auto client = connect(domain_);
  ASSERT_TRUE(client->call({"hosta", plc_OPERATION_START, "line1", ""}, soon()));
  std::ofstream(flag) << "hangs";
  auto reply = std::async(std::launch::async,
                          [&] { return client->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon()); });
  while (host_.answered < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  host_.server().signal(SIGTERM);
  const auto told = reply.get();
  ASSERT_TRUE(told) << told.error().describe();
  EXPECT_EQ(told->code, ErrorCode::ok);
  EXPECT_EQ(host_.requests().size(), 2U);
  std::filesystem::remove(flag);
  EXPECT_EQ(host_.server().wait(), 0);
}

TEST_F(Audit, IsVerifiedAndAChangeFound) {
  for (int i = 0; i < 3; ++i) ASSERT_EQ(run({"stop", "instance", "line1"}).code, 0);
  ASSERT_EQ(recorded("stop", 3).size(), 3U);
  host_.replace_server();
  ASSERT_EQ(run({"stop", "instance", "line1"}).code, 0);
  ASSERT_EQ(recorded("stop", 4).size(), 4U);
  const RunResult whole = run({"verify", "audit", folder_});
  EXPECT_EQ(whole.code, 0) << whole.output;
  EXPECT_THAT(whole.output, HasSubstr("5 records, 1 to 5"));
  {
    std::fstream file(folder_ + "/audit.0000000001.log");
    file.seekp(200);
    file << 'X';
  }
  const RunResult changed = run({"verify", "audit", folder_});
  EXPECT_EQ(changed.code, 1);
  EXPECT_THAT(changed.output, AllOf(HasSubstr("problem"), HasSubstr("audit.0000000001.log:1")));
}

}  // namespace
}  // namespace plchost
