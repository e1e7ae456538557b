// The output of instances: kept for later readers, and never in the way of their cycles.
#include <algorithm>
#include <csignal>

#include <gmock/gmock.h>
#include <unistd.h>

#include "shm/pages/log_ring.hpp"
#include "tests/integration/manager/plant.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

class InstanceLog : public testing::Test {
 protected:
  [[nodiscard]] std::vector<LogRecord> records(const std::string& instance = "line1") const {
    const auto reader = LogRingReader::open(plant_.pool(), instance);
    return reader ? reader->read(0, kLogRecordsKept).records : std::vector<LogRecord>();
  }
  [[nodiscard]] bool has(LogSource source, std::string_view text) const {
    return std::ranges::any_of(records(), [&](const LogRecord& record) {
      return record.source == source && record.text.view().contains(text);
    });
  }
  [[nodiscard]] bool wait_for_crash() {
    return Plant::eventually([&] { return has(LogSource::manager, "killed by"); });
  }
  Plant plant_;
};

TEST_F(InstanceLog, HasTheLastWordsOfAProcessThatCrashed) {
  plant_.add("line1", "manager_last_words", "restart_delay_ms = 1000\nrestart_delay_max_ms = 1000");
  plant_.start_manager();
  ASSERT_TRUE(wait_for_crash());
  const auto said = records();
  const auto printed = std::ranges::find_if(
      said, [](const LogRecord& one) { return one.text.view() == "last words: pressure 9 bar"; });
  ASSERT_NE(printed, said.end());
  EXPECT_EQ(printed->source, LogSource::output);
  EXPECT_GT(printed->pid, 0);
  EXPECT_TRUE(has(LogSource::output, "?[31mred?[0m")) << "a line without an end, and no colours";
  EXPECT_TRUE(has(LogSource::application, "valve 7 is stuck"));
  EXPECT_TRUE(has(LogSource::runtime, "stopped -> running")) << "the instance's own lines";
  EXPECT_TRUE(has(LogSource::manager, "killed by SIGSEGV"));
  EXPECT_THAT(plant_.log(), HasSubstr("last words: pressure 9 bar")) << "also in the log of the manager";
}

TEST_F(InstanceLog, OutlivesTheInstanceAndTheManager) {
  plant_.add("line1", "manager_last_words", "restart_delay_ms = 100\ncrash_limit = 100");
  plant_.start_manager();
  ASSERT_TRUE(wait_for_crash());
  plant_.kill_manager();
  const auto before = records();
  ASSERT_FALSE(before.empty());
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  const auto after = records();
  ASSERT_GT(after.size(), before.size());
  EXPECT_EQ(after.front().sequence, before.front().sequence) << "one numbering over all managers";
  EXPECT_EQ(after.front().text.view(), before.front().text.view());
}

TEST_F(InstanceLog, HasWhatWasSaidWhileNoManagerRan) {
  plant_.add("line1", "held");
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  plant_.kill_manager();
  auto link = PacketSocket::connect(plant_.run_directory() + "/line1.sock");
  ASSERT_TRUE(link);
  ASSERT_TRUE(link->send(encode(ControlRequest{
      .number = 1, .verb = ControlVerb::unregister_event, .instance = "line1", .argument = "no_such"})));
  ASSERT_TRUE(Plant::eventually([&] { return link->receive().value_or(std::nullopt).has_value(); }));
  EXPECT_FALSE(has(LogSource::runtime, "no_such"));
  plant_.start_manager();
  EXPECT_TRUE(Plant::eventually([&] { return has(LogSource::runtime, "no_such"); }));
  EXPECT_TRUE(has(LogSource::manager, "has adopted process"));
}

// A machine does not stop because nobody reads its log.
TEST_F(InstanceLog, HoldsNoCycleUpWhenTheManagerStandsStill) {
  plant_.add("line1", "manager_chatter");
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  plant_.signal_manager(SIGSTOP);
  constexpr std::uint64_t kCycles = 1000;  // 2 MB
  EXPECT_TRUE(plant_.wait_for_cycles("line1", kCycles));
}

TEST_F(InstanceLog, HoldsNoCycleUpWhenNobodyReadsTheLogOfTheManager) {
  auto pipe = make_output_pipe();
  ASSERT_TRUE(pipe);
  plant_.add("line1", "manager_chatter");
  plant_.start_manager(pipe->write_end.get());
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  constexpr std::uint64_t kCycles = 1000;
  EXPECT_TRUE(plant_.wait_for_cycles("line1", kCycles));
  EXPECT_EQ(plant_.ask(ControlVerb::stop, "line1").code, ErrorCode::ok) << "nor the manager";
}

TEST_F(InstanceLog, SaysWhereLinesAreMissing) {
  plant_.add("line1", "manager_chatter");
  plant_.start_manager();
  ASSERT_TRUE(plant_.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(Plant::eventually([&] { return has(LogSource::manager, "lines are missing here"); }));
}

}  // namespace
}  // namespace plchost
