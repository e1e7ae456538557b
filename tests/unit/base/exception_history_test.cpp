#include "shm/pages/exception_history.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/base/fault_record.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

class ExceptionHistoryTest : public testing::Test {
 protected:
  ~ExceptionHistoryTest() override { std::filesystem::remove(path_); }
  void write(const std::string& text) const { std::ofstream(path_) << text; }
  static ExceptionEntry entry(std::string text) {
    ExceptionEntry made;
    made.task = "Fill";
    made.kind = "signal";
    made.signal = "SIGSEGV";
    made.address = 0xffff'ffff'ffff'fff0;
    made.text = std::move(text);
    made.back_trace = {"fill(int)+0x12 in line.so", "0x7f12"};
    made.back_trace_end = "only a part is known";
    made.activity = {"-1.204 ms Fill: start, 3.1 us after its release"};
    made.circumstances.version = "0.1.0";
    made.circumstances.build = "GCC 12, build ID 4f";
    made.circumstances.scheduler = "CmpSchedule";
    made.circumstances.settings = "cyclic, interval 10 ms, priority 4, core 1";
    made.circumstances.cycles = 5;
    made.circumstances.uptime_ns = 7;
    return made;
  }

  std::string path_ = own_path("exceptions");
};

TEST_F(ExceptionHistoryTest, ComesBackFromTheFileAsItWasWritten) {
  ExceptionHistory sut;
  sut.add(entry("a \"text\" with \xff and\nlines"));
  ASSERT_TRUE(write_exceptions(path_, sut));
  const auto back = read_exceptions(path_);
  ASSERT_TRUE(back) << back.error().describe();
  EXPECT_EQ(back->count, 1U);
  ASSERT_EQ(back->entries.size(), 1U);
  EXPECT_EQ(back->entries[0].number, 1U);
  EXPECT_EQ(back->entries[0].address, sut.entries[0].address);
  EXPECT_EQ(back->entries[0].task, "Fill");
  EXPECT_EQ(back->entries[0].back_trace, sut.entries[0].back_trace);
  EXPECT_EQ(back->entries[0].back_trace_end, "only a part is known");
}

TEST_F(ExceptionHistoryTest, KeepsTheCircumstances) {
  ExceptionHistory sut;
  sut.add(entry("first"));
  ASSERT_TRUE(write_exceptions(path_, sut));
  EXPECT_EQ(read_exceptions(path_), sut);
}

TEST_F(ExceptionHistoryTest, OfAVersionBeforeHasNoCircumstances) {
  write(R"({"version": 1, "count": 1, "exceptions": [{"number": 1, "task": "Fill", "kind": "signal"}]})");
  const auto back = read_exceptions(path_);
  ASSERT_TRUE(back) << back.error().describe();
  EXPECT_EQ(back->entries[0].task, "Fill");
  EXPECT_EQ(back->entries[0].circumstances.settings, "");
}

TEST_F(ExceptionHistoryTest, TakesWhatAnotherHasInTheOrderAndWithTheNumbersOfThat) {
  const auto made = [](int time) {
    ExceptionEntry entry = ExceptionHistoryTest::entry("at " + std::to_string(time));
    entry.unix_ns = time;
    return entry;
  };
  ExceptionHistory other;
  for (int time = 1; time <= 20; ++time) other.add(made(time));
  ExceptionHistory sut;
  sut.take(other);
  EXPECT_EQ(sut, other) << "one that has nothing becomes the other";
  other.add(made(21));
  sut.take(other);
  sut.take(other);
  EXPECT_EQ(sut, other) << "a known one is not counted again";
  ExceptionHistory anew;  // of an instance that did not find the one before
  anew.add(made(22));
  sut.take(anew);
  EXPECT_EQ(sut.count, 22U);
  EXPECT_EQ(sut.entries.back().number, 22U);
  EXPECT_EQ(sut.entries.back().text, "at 22");
  EXPECT_EQ(sut.entries.size(), ExceptionHistory::kMaxEntries);
}

TEST_F(ExceptionHistoryTest, TellsTheSettingsOfATaskInWords) {
  EXPECT_EQ(task_settings(TaskKind::cyclic, std::chrono::microseconds(2500), 4, 1),
            "cyclic, interval 2.5 ms, priority 4, core 1");
  EXPECT_EQ(task_settings(TaskKind::external, Duration::zero(), 18, -1),
            "external, priority 18, several cores");
}

TEST_F(ExceptionHistoryTest, SaysThatTheBackTraceOfAProcessThatEndedIsNotKnown) {
  const ExceptionEntry made = exception_entry({}, "/opt/line.so", "Fill");
  EXPECT_TRUE(made.back_trace.empty());
  EXPECT_NE(made.back_trace_end, "");
}

// Its process knows no more of them: it walks the stack where a signal stopped the thread.
TEST_F(ExceptionHistoryTest, SaysOfFaultsWithoutAStackThatThereIsNone) {
  const std::string none = describe_end(BackTrace{});
  const std::string lost = exception_entry({}, "/opt/line.so", "Fill").back_trace_end;
  EXPECT_NE(lost, none);
  FaultRecord record;
  record.kind = FaultKind::cpp_exception;
  EXPECT_EQ(exception_entry(record, "/opt/line.so", "Fill").back_trace_end, none);
  record.kind = FaultKind::task_watchdog;
  EXPECT_EQ(exception_entry(record, "/opt/line.so", "Fill").back_trace_end, none);
  record.address = 0x7f12;
  EXPECT_EQ(exception_entry(record, "/opt/line.so", "Fill").back_trace_end, lost);
}

// Of a version that had none.
TEST_F(ExceptionHistoryTest, IsReadWithoutBackTraces) {
  write(R"({"version":1,"count":1,"exceptions":[{"number":1,"task":"Fill"}]})");
  const auto history = read_exceptions(path_);
  ASSERT_TRUE(history);
  EXPECT_EQ(history->entries[0].task, "Fill");
  EXPECT_TRUE(history->entries[0].back_trace.empty());
}

// The manager knows them not, nor does an instance of a version before.
TEST_F(ExceptionHistoryTest, KeepsTheCircumstancesThatAnotherFinderDoesNotKnow) {
  ExceptionHistory sut;
  ExceptionEntry fault = entry("abort");
  fault.unix_ns = 1000;
  sut.add(fault);
  ExceptionEntry poorer = fault;
  poorer.symbol = "fill()+0x12";
  poorer.circumstances.version = poorer.circumstances.build = poorer.circumstances.scheduler =
      poorer.circumstances.settings = "";
  poorer.circumstances.cycles = 0;
  poorer.circumstances.uptime_ns = 0;
  sut.add(poorer);
  fault.number = 1;
  fault.symbol = "fill()+0x12";
  ASSERT_EQ(sut.entries.size(), 1U);
  EXPECT_EQ(sut.entries[0], fault);
}

// Counted on, they would begin at 0 again.
TEST_F(ExceptionHistoryTest, IsNotReadWithNumbersThatNoInstanceReaches) {
  write(R"({"version":1,"count":18446744073709551615,"exceptions":[]})");
  EXPECT_EQ(read_exceptions(path_).error().code, ErrorCode::corrupt);
  write(R"({"version":1,"count":1,"exceptions":[{"number":18446744073709551615,"task":"Fill"}]})");
  EXPECT_EQ(read_exceptions(path_).error().code, ErrorCode::corrupt);
}

TEST_F(ExceptionHistoryTest, KeepsTheLastSixteenAndCountsAll) {
  ExceptionHistory sut;
  for (int i = 0; i < 20; ++i) sut.add(entry("x"));
  EXPECT_EQ(sut.count, 20U);
  ASSERT_EQ(sut.entries.size(), ExceptionHistory::kMaxEntries);
  EXPECT_EQ(sut.entries.front().number, 5U);
  EXPECT_EQ(sut.entries.back().number, 20U);
}

TEST_F(ExceptionHistoryTest, HasTheSameFaultOnceWhoeverFoundIt) {
  ExceptionHistory sut;
  ExceptionEntry fault = entry("abort");
  fault.unix_ns = 1000;
  sut.add(fault);
  fault.symbol = "fill()+0x12";
  sut.add(fault);
  fault.symbol = "";  // by the manager, once more
  sut.add(fault);
  fault.task = "Other";
  sut.add(fault);
  EXPECT_EQ(sut.count, 2U);
  EXPECT_EQ(sut.entries[0].symbol, "fill()+0x12");
  EXPECT_EQ(sut.entries[0].number, 1U);
}

// The manager wrote it first, and its process could go on.
TEST_F(ExceptionHistoryTest, HasWhatItsProcessSaysOfAFaultWithoutASymbol) {
  FaultRecord record;
  record.unix_ns = 1000;
  ExceptionHistory sut;
  const ExceptionEntry of_manager = exception_entry(record, "/opt/line.so", "Fill");
  sut.add(of_manager);
  ExceptionEntry of_process = of_manager;
  of_process.back_trace_end = "the stack is overwritten";
  sut.add(of_process);
  EXPECT_EQ(sut.entries[0].back_trace_end, "the stack is overwritten");
  sut.add(of_manager);
  EXPECT_EQ(sut.entries[0].back_trace_end, "the stack is overwritten");
  of_process.back_trace = {"0x7f12"};
  sut.add(of_process);
  of_process.back_trace.clear();
  sut.add(of_process);
  EXPECT_THAT(sut.entries[0].back_trace, testing::ElementsAre("0x7f12"));
  EXPECT_EQ(sut.count, 1U);
}

// The manager finds all faults of a process at its end, also those that are not kept any more.
TEST_F(ExceptionHistoryTest, CountsNoFaultOfManyTwice) {
  std::vector<ExceptionEntry> faults;
  for (int i = 1; i <= 20; ++i) {
    ExceptionEntry& fault = faults.emplace_back(entry("abort"));
    fault.unix_ns = 1000 * i;
    fault.symbol = "fill()+0x12";
    EXPECT_EQ(keep_exceptions(path_, std::span(&fault, 1)), "");
  }
  const ExceptionHistory written = read_exceptions(path_).value();
  EXPECT_EQ(written.count, 20U);
  for (ExceptionEntry& fault : faults) {  // by the manager
    fault.symbol = "";
    fault.back_trace.clear();
  }
  EXPECT_EQ(keep_exceptions(path_, faults), "");
  EXPECT_EQ(read_exceptions(path_).value(), written);
}

TEST_F(ExceptionHistoryTest, ReplacesNoKnownFaultByANewerOneAndThenAddsItAgain) {
  std::vector<ExceptionEntry> faults;
  for (int i = 1; i <= 20; ++i) {
    faults.emplace_back(entry("abort")).unix_ns = 1000 * i;
    if (i == 18) continue;
    EXPECT_EQ(keep_exceptions(path_, std::span(&faults.back(), 1)), "");
  }
  std::swap(faults[0], faults[17]);  // a clock that was set back
  EXPECT_EQ(keep_exceptions(path_, faults), "");
  const ExceptionHistory kept = read_exceptions(path_).value();
  EXPECT_EQ(kept.count, 20U);
  EXPECT_EQ(kept.entries.back().unix_ns, 18'000);
}

// A clock without a battery, at a start.
TEST_F(ExceptionHistoryTest, KeepsAFaultThatIsOlderThanThoseOfTheFuture) {
  ExceptionEntry fault = entry("abort");
  for (int i = 1; i <= 20; ++i) {
    fault.unix_ns = std::numeric_limits<std::int64_t>::max() - 100 + i;
    EXPECT_EQ(keep_exceptions(path_, std::span(&fault, 1)), "");
  }
  fault.unix_ns = 1000;
  EXPECT_EQ(keep_exceptions(path_, std::span(&fault, 1)), "");
  EXPECT_EQ(read_exceptions(path_)->count, 21U);
  EXPECT_EQ(read_exceptions(path_)->entries.back().unix_ns, 1000);
}

TEST_F(ExceptionHistoryTest, DropsTheOldestBackTracesUntilItsReaderTakesIt) {
  ExceptionHistory history;
  for (int i = 1; i <= 16; ++i) {
    ExceptionEntry fault = entry("abort");
    fault.back_trace.assign(32, std::string(500, '"'));
    history.add(fault);
  }
  ASSERT_TRUE(write_exceptions(path_, history));
  const auto back = read_exceptions(path_);
  ASSERT_TRUE(back) << back.error().describe();
  EXPECT_EQ(back->count, 16U);
  ASSERT_EQ(back->entries.size(), 16U);
  EXPECT_TRUE(back->entries.front().activity.empty());
  EXPECT_TRUE(back->entries.front().back_trace.empty());
  EXPECT_EQ(back->entries.front().back_trace_end, "it was dropped for those of newer exceptions");
  EXPECT_EQ(back->entries.back(), history.entries.back());
}

TEST_F(ExceptionHistoryTest, DropsOldActivitiesBeforeTheBackTraceBesideThem) {
  ExceptionHistory history;
  for (int i = 1; i <= 16; ++i) {
    ExceptionEntry fault = entry("abort");
    fault.activity.assign(128, std::string(125, '-'));
    history.add(fault);
  }
  ASSERT_TRUE(write_exceptions(path_, history));
  const auto back = read_exceptions(path_);
  ASSERT_TRUE(back) << back.error().describe();
  ASSERT_EQ(back->entries.size(), 16U);
  EXPECT_EQ(back->entries.back(), history.entries.back());
  const auto whole =
      std::ranges::find_if(back->entries, [](const auto& one) { return !one.activity.empty(); });
  EXPECT_NE(whole, back->entries.begin());
  EXPECT_FALSE(whole->back_trace.empty());
}

TEST_F(ExceptionHistoryTest, DropsTheOldestEntriesUntilItsReaderTakesIt) {
  ExceptionHistory history;
  for (int i = 1; i <= 16; ++i) history.add(entry(std::string(100'000, 'x')));
  ASSERT_TRUE(write_exceptions(path_, history));
  const auto back = read_exceptions(path_);
  ASSERT_TRUE(back) << back.error().describe();
  EXPECT_EQ(back->count, 16U);
  ASSERT_EQ(back->entries.size(), 2U);
  EXPECT_EQ(back->entries.back().number, 16U);
}

TEST_F(ExceptionHistoryTest, IsKeptOnInTheFile) {
  const std::vector<ExceptionEntry> first{entry("one"), entry("two")};
  const std::vector<ExceptionEntry> second{entry("three")};
  EXPECT_EQ(keep_exceptions(path_, first), "");
  EXPECT_EQ(keep_exceptions(path_, second), "");
  const auto history = read_exceptions(path_);
  ASSERT_TRUE(history);
  EXPECT_EQ(history->count, 3U);
  EXPECT_EQ(history->entries.back().text, "three");
}

TEST_F(ExceptionHistoryTest, IsNotWrittenAgainWithoutNews) {
  ExceptionEntry fault = entry("abort");
  fault.unix_ns = 1000;
  fault.symbol = "fill()+0x12";
  ASSERT_TRUE(keep_exceptions(path_, std::vector{fault}));
  const auto written = std::filesystem::last_write_time(path_);
  fault.symbol = "";  // by the manager
  ASSERT_TRUE(keep_exceptions(path_, std::vector{fault}));
  EXPECT_EQ(std::filesystem::last_write_time(path_), written);
}

TEST_F(ExceptionHistoryTest, BeginsAnewWhereTheFileIsSomethingElseAndSaysSo) {
  write("[]");
  const auto remark = keep_exceptions(path_, std::vector{entry("one")});
  ASSERT_TRUE(remark);
  EXPECT_THAT(*remark, testing::HasSubstr("is not a JSON object"));
  EXPECT_EQ(read_exceptions(path_)->count, 1U);
}

TEST_F(ExceptionHistoryTest, ThatCannotBeWrittenIsAnError) {
  const auto kept = keep_exceptions(testing::TempDir() + "/no such folder/x", std::vector{entry("one")});
  ASSERT_FALSE(kept);
}

TEST_F(ExceptionHistoryTest, IsEmptyWithoutAFile) {
  const auto history = read_exceptions(path_);
  ASSERT_TRUE(history);
  EXPECT_EQ(history->count, 0U);
}

// Another user may write the folder.
TEST_F(ExceptionHistoryTest, IsNotReadThroughALink) {
  const std::string other = path_ + ".other";
  ASSERT_TRUE(write_exceptions(other, {}));
  std::filesystem::create_symlink(other, path_);
  EXPECT_EQ(read_exceptions(path_).error().code, ErrorCode::corrupt);
  std::filesystem::remove(path_);
  std::filesystem::create_hard_link(other, path_);
  EXPECT_EQ(read_exceptions(path_).error().code, ErrorCode::corrupt);
  std::filesystem::remove(other);
  EXPECT_TRUE(read_exceptions(path_));
}

TEST_F(ExceptionHistoryTest, RefusesWhatIsSomethingElse) {
  for (const char* const text :
       {"", "{", "[]", "{\"version\":9}", "{\"version\":1,\"exceptions\":[{\"number\":\"x\"}]}",
        "{\"version\":1,\"exceptions\":[7]}", "{\"version\":28446744073709551615}", "{\"version\":1.0}"}) {
    write(text);
    const auto history = read_exceptions(path_);
    ASSERT_FALSE(history) << text;
    EXPECT_EQ(history.error().code, ErrorCode::corrupt) << text;
    EXPECT_THAT(history.error().message, testing::HasSubstr(path_));
  }
}

// It would take the stack of each process that reads it.
TEST_F(ExceptionHistoryTest, RefusesAFileOfManyLevels) {
  constexpr std::size_t kLevels = 100'000;
  const std::string file =
      "{\"version\":1,\"exceptions\":" + std::string(kLevels, '[') + std::string(kLevels, ']') + "}";
  write(file);
  const auto history = read_exceptions(path_);
  ASSERT_FALSE(history);
  EXPECT_EQ(history.error().code, ErrorCode::corrupt);
}

// Its time lies in shared memory.
TEST(TimeOfAFault, IsNoneToComeWhateverAStrangerHasWritten) {
  using Limits = std::numeric_limits<std::int64_t>;
  for (const std::int64_t unix_ns : {Limits::min(), std::int64_t{-1}, Limits::max()}) {
    const TimePoint at = time_of_fault(unix_ns);
    EXPECT_LE(at, MonotonicClock::now()) << unix_ns;
  }
}

}  // namespace
}  // namespace plchost
