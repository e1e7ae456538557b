// The output of an instance, told to operators.
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "shm/base/time.hpp"
#include "shm/pages/log_ring.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

class RemoteLog : public testing::Test {
 protected:
  RemoteLog() {
    host_.write_instance(0, "line1", InstanceState::running, 4711);
    host_.write_count(1);
    host_.start_server();
  }
  ~RemoteLog() override { LogRing::remove(host_.pool_name(), "line1"); }
  void say(std::string_view text, LogSource source = LogSource::output,
           std::int64_t unix_ns = unix_time_ns()) {
    if (!ring_) ring_ = LogRing::open(host_.pool_name(), "line1").value();
    ring_->add(
        {.time_unix_ns = unix_ns, .pid = 4711, .level = LogLevel::warning, .source = source, .text = text});
  }
  [[nodiscard]] RunResult logs(std::vector<std::string> arguments = {}) const {
    arguments.insert(arguments.begin(), {"logs", "line1"});
    return run_plcctl(domain_.number(), std::move(arguments));
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  std::optional<LogRing> ring_;
};

TEST_F(RemoteLog, IsShownLineByLine) {
  EXPECT_EQ(logs().output, "") << "it has said nothing yet";
  say("valve 7 is stuck", LogSource::application, 1'800'000'000'250'000'000);
  say("\x1b[2Jcleared");
  const auto shown = logs();
  ASSERT_EQ(shown.code, 0) << shown.errors;
  EXPECT_THAT(shown.output, HasSubstr("2027-01-15T08:00:00.250Z  warning  application  valve 7 is stuck\n"));
  EXPECT_THAT(shown.output, AllOf(HasSubstr("  output       ?[2Jcleared\n"), Not(HasSubstr("\x1b"))));
  const auto json = Json::parse(logs({"--json"}).output);
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0]["instance"], "line1");
  EXPECT_EQ(json[0]["sequence"], 1);
  EXPECT_EQ(json[0]["time_unix_ns"], 1'800'000'000'250'000'000);
  EXPECT_EQ(json[0]["pid"], 4711);
  EXPECT_EQ(json[0]["level"], "warning");
  EXPECT_EQ(json[0]["source"], "application");
  EXPECT_EQ(json[0]["text"], "valve 7 is stuck");
}

TEST_F(RemoteLog, ComesInPagesWholeAndInOrder) {
  constexpr std::size_t kSaid = kLogRecordsKept + 100;
  for (std::size_t i = 1; i <= kSaid; ++i) say(fmt::format("line {}", i));
  const auto json = Json::parse(logs({"--json"}).output);
  ASSERT_EQ(json.size(), kLogRecordsKept);
  for (std::size_t i = 0; i < json.size(); ++i) ASSERT_EQ(json[i]["sequence"], i + 101);
  const auto newest = Json::parse(logs({"--json", "-n", "300"}).output);
  ASSERT_EQ(newest.size(), 300U);
  EXPECT_EQ(newest[0]["text"], "line 825");
  EXPECT_EQ(newest[299]["text"], "line 1124");
  EXPECT_EQ(Json::parse(logs({"--json", "-n", "0"}).output).size(), 0U);
}

TEST_F(RemoteLog, PutsLongLinesTogether) {
  const std::string text(1000, 'x');
  say(text);
  const auto json = Json::parse(logs({"--json"}).output);
  ASSERT_EQ(json.size(), 1U);
  EXPECT_EQ(json[0]["text"], text);
}

TEST_F(RemoteLog, BeginsAtATime) {
  say("an hour ago", LogSource::output, unix_time_ns() - 3'600'000'000'000);
  say("now");
  EXPECT_THAT(logs({"--since", "10m"}).output, AllOf(HasSubstr("now"), Not(HasSubstr("an hour ago"))));
  EXPECT_THAT(logs({"--since", "2h"}).output, AllOf(HasSubstr("now"), HasSubstr("an hour ago")));
  EXPECT_EQ(logs({"--since", "2099-01-01T00:00:00Z"}).output, "");
  EXPECT_THAT(logs({"--since", "2020-01-01T00:00:00.250Z"}).output, HasSubstr("an hour ago"));
  for (const char* const wrong : {"10", "m", "-1m", "0m", "99999999999d", "yesterday", "2020-01-01"}) {
    const auto refused = logs({"--since", wrong});
    EXPECT_EQ(refused.code, 2) << wrong;
    EXPECT_THAT(refused.errors, HasSubstr("allowed are 90s")) << wrong;
  }
}

TEST_F(RemoteLog, OfAnInstanceThatIsNotThereIsRefused) {
  const auto refused = run_plcctl(domain_.number(), {"logs", "line2"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("no instance 'line2' on host 'hosta'; there are: line1"));
}

TEST_F(RemoteLog, IsFollowedAlsoOverTheEndOfTheServerAndANewNumbering) {
  say("before");
  const std::string seen = own_path("logs");
  Child follower(PLCCTL_PROGRAM,
                 {"--domain", std::to_string(domain_.number()), "logs", "line1", "-f", "--timeout", "60"},
                 seen);
  const auto shows = [&](std::string_view text) {
    for (const TimePoint end = soon(); MonotonicClock::now() < end;) {
      std::ifstream file(seen);
      const std::string all{std::istreambuf_iterator<char>(file), {}};
      if (all.contains(text)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  };
  EXPECT_TRUE(shows("before"));
  say("meanwhile");
  EXPECT_TRUE(shows("meanwhile"));
  host_.replace_server();
  say("after the server");
  EXPECT_TRUE(shows("after the server"));
  LogRing::remove(host_.pool_name(), "line1");
  ring_.reset();
  say("of a new numbering");
  EXPECT_TRUE(shows("of a new numbering"));
  follower.signal(SIGINT);
  EXPECT_EQ(follower.wait(), 0) << std::ifstream(seen + ".errors").rdbuf();
  ::unlink(seen.c_str());
  ::unlink((seen + ".errors").c_str());
}

TEST_F(RemoteLog, OverWhichAStrangerWroteHarmsNobody) {
  for (int i = 0; i < 50; ++i) say("said by us");
  const MemoryFile memory =
      MemoryFile::open(log_ring_name(host_.pool_name(), "line1"), 1, MemoryFile::Access::read_write).value();
  auto& ring = *reinterpret_cast<LogRingLayout*>(memory.bytes().data());
  for (auto& slot : ring.slots) {
    LogRecord record{
        .sequence = static_cast<std::uint64_t>(&slot - ring.slots.data()), .goes_on = 1, .text = {}};
    record.text.assign("\x1b]0;title\a");
    slot.write(record);
  }
  ring.last = kLogRecordsKept - 1;
  const auto shown = logs();
  EXPECT_EQ(shown.code, 0) << shown.errors;
  EXPECT_THAT(shown.output, Not(HasSubstr("\x1b")));
  ring.last = ~std::uint64_t{0};
  EXPECT_EQ(logs().code, 0);
  ring.magic = 0;
  EXPECT_THAT(logs().errors, HasSubstr("is not a log"));
  EXPECT_EQ(run_plcctl(domain_.number(), {"list", "instances"}).code, 0);
}

}  // namespace
}  // namespace plchost
