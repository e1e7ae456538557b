// Recordings of variables: when their samples are taken, and their text.
#include "api/recording/variable_recording.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/own_name.hpp"
#include "tests/unit/api/debugged_instance.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr Duration kShort = std::chrono::microseconds(100);

VariableListing recorded_sample(std::initializer_list<plc_VariableRecord> variables) {
  VariableListing sample{.time_unix_ns = 1'600'000'000'000'000'000, .variables = {}};
  sample.variables.assign(variables.begin(), variables.end());
  return sample;
}

plc_VariableRecord as_forced(plc_VariableRecord record) {
  record.forced = true;
  return record;
}

/// Answers that are given one after the other, the last one again and again.
struct Answers {
  std::vector<Result<VariableListing>> given;
  std::size_t next = 0;
  std::size_t used = 0;
  std::vector<std::string> silences = {};

  [[nodiscard]] SampleActions actions(std::size_t enough, bool interrupted = false) {
    return {.sample =
                [this](TimePoint /*latest*/) {
                  const std::size_t now = std::min(next++, given.size() - 1);
                  return given[now];
                },
            .use = [this, enough](const VariableListing& /*sample*/) { return ++used < enough; },
            .sleep_until = [interrupted](TimePoint /*next*/) { return !interrupted; },
            .tell_silence = [this](const Error& error) { silences.push_back(error.message); }};
  }
};

Result<VariableListing> silence(const char* text) {
  return failure(ErrorCode::timed_out, text);
}

TEST(Samples, AreTakenUntilThereAreEnough) {
  Answers answers{.given = {VariableListing()}};
  EXPECT_TRUE(sample_again_and_again({.interval = kShort}, answers.actions(3)).value());
  EXPECT_EQ(answers.used, 3U);
}

TEST(Samples, AreTakenUntilItIsInterrupted) {
  Answers answers{.given = {VariableListing()}};
  EXPECT_TRUE(sample_again_and_again({.interval = kShort}, answers.actions(3, true)).value());
  EXPECT_EQ(answers.used, 1U);
}

TEST(Samples, AreTakenFurtherAfterASilenceThatIsToldOnce) {
  Answers answers{.given = {VariableListing(), silence("a"), silence("b"), VariableListing(), silence("c"),
                            VariableListing()}};
  EXPECT_TRUE(sample_again_and_again({.interval = kShort}, answers.actions(3)).value());
  EXPECT_THAT(answers.silences, ElementsAre("a", "c"));
}

TEST(Samples, EndWithTheSilenceOfTheirTime) {
  Answers answers{.given = {VariableListing(), silence("a")}};
  const SampleTimes times{.interval = kShort, .until = MonotonicClock::now() + std::chrono::milliseconds(5)};
  EXPECT_FALSE(sample_again_and_again(times, answers.actions(1'000'000)).value());
  EXPECT_THAT(answers.silences, ElementsAre("a"));
}

TEST(Samples, EndWithAnErrorThatStays) {
  Answers first{.given = {silence("a")}};
  EXPECT_EQ(sample_again_and_again({.interval = kShort}, first.actions(3)).error().message, "a");
  Answers later{.given = {VariableListing(), failure(ErrorCode::not_found, "gone")}};
  EXPECT_EQ(sample_again_and_again({.interval = kShort}, later.actions(3)).error().message, "gone");
  EXPECT_THAT(first.silences, IsEmpty());
  EXPECT_THAT(later.silences, IsEmpty());
}

TEST(Samples, HaveAllVariablesOfTheQuery) {
  const VariableQuery query{.patterns = {"a", "b*"}};
  EXPECT_TRUE(sample_in(recorded_sample({variable_record("a", "INT", "1")}), "line1", query));
  EXPECT_THAT(sample_in({}, "line1", query).error().message, "no variable of 'line1' is like a, b*");
  EXPECT_EQ(sample_in({.complete = false}, "line1", query).error().code, ErrorCode::full);
  EXPECT_TRUE(sample_in({}, "line1", {})) << "an application that declares none";
}

TEST(Recording, NamesInTheLastColumnWhatIsForced) {
  const auto a = variable_record("a", "INT", "7");
  const auto b = variable_record("grid[1,2]", "INT", "8");
  const auto c = variable_record("s", "STRING[9]", "'x,y'");
  EXPECT_EQ(recording_head(recorded_sample({a, b, c})),
            "time,time_unix_ns,consistent,a,\"grid[1,2]\",s,forced");
  const std::string line = recording_line(recorded_sample({a, b, c}));
  EXPECT_EQ(line, "2020-09-13T12:26:40.000Z,1600000000000000000,true,7,8,\"'x,y'\",");
  EXPECT_EQ(recording_line(recorded_sample({as_forced(a), b, c})), line + "a");
  EXPECT_EQ(recording_line(recorded_sample({as_forced(a), as_forced(b), c})), line + "\"a grid[1,2]\"");
  EXPECT_EQ(recording_head(recorded_sample({as_forced(a)})), "time,time_unix_ns,consistent,a,forced");
}

TEST(Recording, NamesTheVariablesOnceAndEndsWhenThereAreOthers) {
  RecordingText sut;
  const auto a = recorded_sample({variable_record("a", "INT", "7")});
  EXPECT_THAT(sut.lines_of(a).value(), "time,time_unix_ns,consistent,a,forced\n" + recording_line(a) + "\n");
  EXPECT_EQ(sut.lines_of(a).value(), recording_line(a) + "\n");
  const auto other = sut.lines_of(recorded_sample({variable_record("b", "INT", "7")}));
  EXPECT_EQ(other.error().code, ErrorCode::wrong_state);
  EXPECT_EQ(sut.lines_of(a).value(), recording_line(a) + "\n");
}

TEST(Recording, ReplacesAnEarlierOneWithItsFirstSample) {
  const auto folder = own_path("recording");
  std::filesystem::create_directory(folder);
  const auto path = folder / "record.csv";
  const auto contents = [&] {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  };
  std::ofstream(path) << "an earlier one\n";
  RecordingFile sut(path);
  EXPECT_EQ(contents(), "an earlier one\n");
  EXPECT_TRUE(sut.write("a\n1\n"));
  EXPECT_TRUE(sut.write("2\n"));
  EXPECT_EQ(contents(), "a\n1\n2\n");
  EXPECT_EQ(sut.samples(), 2U);
  EXPECT_THAT(RecordingFile(folder / "none" / "x").write("a\n").error().message, HasSubstr("cannot write "));
  RecordingFile full("/dev/full");
  EXPECT_EQ(full.write("a\n").error().message, "cannot write the recording, which ends after 0 samples");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace plchost
