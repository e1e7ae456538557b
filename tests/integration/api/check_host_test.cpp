#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const HostFinding kGood{"clock_source", FindingLevel::ok, "clock source", "tsc", "why not", ""};
const HostFinding kNote{"swap", FindingLevel::note, "swap", "/dev/sda2", "it is slow", "swapoff -a"};
const HostFinding kWarning{"governor",  FindingLevel::warning, "core 1 (line1)",
                           "powersave", "slow at first",       "use performance"};
const HostFinding kProblem{"real_time_class", FindingLevel::problem, "SCHED_FIFO",
                           "refused\x1b[2J",  "no hard time",        "give it the right"};

class CheckHost : public testing::Test {
 protected:
  void start(std::vector<HostFinding> findings) {
    host_.find(std::move(findings));
    host_.start_server();
  }
  [[nodiscard]] RunResult run(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"--timeout", "20", "check", "host"});
    return run_plcctl(domain_.number(), std::move(more));
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
};

TEST_F(CheckHost, PrintsTheWorstFirstWithWhatToChange) {
  start({kGood, kNote, kWarning, kProblem});
  const auto result = run();
  EXPECT_EQ(result.code, 1) << result.errors;
  const auto problem = result.output.find("problem  real_time_class");
  const auto warning = result.output.find("warning  governor            core 1 (line1): powersave\n");
  const auto note = result.output.find("note     swap");
  ASSERT_NE(note, std::string::npos) << result.output;
  EXPECT_LT(problem, warning);
  EXPECT_LT(warning, note);
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("why:    slow at first\n"), HasSubstr("change: use performance\n"),
                    HasSubstr("1 problem, 1 warning, 1 note, 1 ok (--all shows them)"),
                    Not(HasSubstr("clock_source")), Not(HasSubstr("\x1b"))));
  EXPECT_THAT(run({"--all"}).output, HasSubstr("ok       clock_source"));
}

TEST_F(CheckHost, HasAnExitCodeForEachLevel) {
  start({kGood, kNote});
  EXPECT_EQ(run().code, 0);
  host_.find({kWarning, kGood});
  EXPECT_EQ(run().code, 4);
  host_.find({kWarning, kProblem});
  EXPECT_EQ(run().code, 1);
}

TEST_F(CheckHost, WritesFlatObjectsForPrograms) {
  start({kGood, kWarning});
  const auto json = nlohmann::json::parse(run({"--json"}).output);
  ASSERT_EQ(json.size(), 1U);
  EXPECT_EQ(json[0]["host"], "hosta");
  EXPECT_EQ(json[0]["id"], "governor");
  EXPECT_EQ(json[0]["level"], "warning");
  EXPECT_EQ(json[0]["subject"], "core 1 (line1)");
  EXPECT_EQ(json[0]["found"], "powersave");
  EXPECT_EQ(json[0]["why"], "slow at first");
  EXPECT_EQ(json[0]["advice"], "use performance");
  EXPECT_EQ(nlohmann::json::parse(run({"--json", "--all"}).output).size(), 2U);
}

TEST_F(CheckHost, LooksAnewEachTimeAndForgetsWhatHasGone) {
  start({kWarning, kNote});
  const auto client = connect(domain_);
  EXPECT_EQ(client->check_host("hosta", soon()).value().size(), 2U);
  std::uint64_t before = 0;  // the server's own check at its start may go on beside that
  do {
    before = host_.checks();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  } while (host_.checks() != before);
  EXPECT_GE(before, 2U);
  host_.find({kNote});
  const auto findings = client->check_host("hosta", soon()).value();
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_STREQ(findings[0].id, "swap");
  EXPECT_GT(host_.checks(), before);
}

TEST_F(CheckHost, SaysThatTheManagerDoesNotAnswer) {
  start({kNote});
  host_.silent = true;
  const auto client = connect(domain_);
  ASSERT_TRUE(client->host("hosta", soon()));
  const auto asked = client->check_host("hosta", MonotonicClock::now() + std::chrono::seconds(1));
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().code, ErrorCode::timed_out);
}

}  // namespace
}  // namespace plchost
