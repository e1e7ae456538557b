// Start offset and late policy.
#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

class TaskOptions : public testing::TestWithParam<std::string_view>, public ManualTasks {
 protected:
  void TearDown() override { finish(); }

  TaskConfig noting(std::string name, Duration interval, Starts& starts) {
    return cyclic(std::move(name), interval, [this, &starts] { starts.push_back(clock.now()); });
  }
};

TEST_P(TaskOptions, StartOffsetMovesTheGridOfOneTaskAgainstTheOthers) {
  Starts plain;
  Starts moved;
  add(noting("plain", milliseconds(5), plain));
  TaskConfig config = noting("moved", milliseconds(5), moved);
  config.start_offset = milliseconds(3);
  add(config);
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(52));
  EXPECT_EQ(plain, grid(origin, milliseconds(5), 11));
  EXPECT_EQ(moved, grid(origin + milliseconds(3), milliseconds(5), 10));
  EXPECT_EQ(counters(1).latency_max_ns, 0);
  EXPECT_EQ(counters(1).lost_cycles, 0U);
}

TEST_P(TaskOptions, StartOffsetHoldsAfterAnOverrunAndAfterANewStart) {
  Starts starts;
  TaskConfig config = cyclic("main", milliseconds(4), [&] {
    starts.push_back(clock.now());
    if (starts.size() == 2) clock.spend(milliseconds(7));
  });
  config.start_offset = milliseconds(1);
  add(config);
  ASSERT_TRUE(create());
  TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(18));
  const auto at = [&](int ms) { return origin + milliseconds(ms); };
  EXPECT_EQ(starts, (Starts{at(1), at(5), at(13), at(17)}));
  ASSERT_TRUE(set->stop(std::chrono::seconds(10)));
  clock.run_for(std::chrono::microseconds(1234));
  starts.assign(3, TimePoint{});
  origin = start(GetParam());
  clock.run_until(origin + milliseconds(6));
  EXPECT_EQ((Starts{starts.begin() + 3, starts.end()}), (Starts{at(1), at(5)}));
}

TEST_P(TaskOptions, StartOffsetIsKeptByASwitch) {
  Starts starts;
  TaskConfig config = noting("main", milliseconds(4), starts);
  config.start_offset = milliseconds(3);
  add(config);
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(9));
  for (const std::string_view next : every_scheduler()) {
    ASSERT_TRUE(set->switch_to(next, {}));
    clock.run_for(milliseconds(8));
  }
  EXPECT_EQ(starts, grid(origin + milliseconds(3), milliseconds(4), static_cast<int>(starts.size())));
  EXPECT_EQ(starts.size(), 8U);
}

TEST_P(TaskOptions, AsapAndStartOffsetTogetherRunTheLastMissedReleaseAtOnce) {
  Starts starts;
  TaskConfig config = cyclic("main", milliseconds(4), [&] {
    starts.push_back(clock.now());
    if (starts.size() == 1) clock.spend(milliseconds(9));
  });
  config.start_offset = milliseconds(2);
  config.late = LatePolicy::asap;
  add(config);
  ASSERT_TRUE(create());
  const TimePoint origin = start(GetParam());
  clock.run_until(origin + milliseconds(18));
  const auto at = [&](int ms) { return origin + milliseconds(ms); };
  EXPECT_EQ(starts, (Starts{at(2), at(11), at(14), at(18)}))
      << "releases at 2, 6 (lost), 10 (at once), 14, 18";
  EXPECT_EQ(counters(0).lost_cycles, 1U);
}

INSTANTIATE_TEST_SUITE_P(Each, TaskOptions, testing::ValuesIn(every_scheduler()), scheduler_test_name);

struct BadOption {
  const char* name;
  void (*spoil)(TaskConfig&);
  const char* complaint;
};

class BadOptions : public testing::TestWithParam<BadOption>, public ManualTasks {};

TEST_P(BadOptions, AreRefusedWithTheTask) {
  TaskConfig config = cyclic("main", milliseconds(4), [] {});
  GetParam().spoil(config);
  add(config);
  const auto created = create();
  ASSERT_FALSE(created);
  EXPECT_EQ(created.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(created.error().message, testing::HasSubstr("task 'main'"));
  EXPECT_THAT(created.error().message, testing::HasSubstr(GetParam().complaint));
}

INSTANTIATE_TEST_SUITE_P(
    Each, BadOptions,
    testing::Values(
        BadOption{"OffsetOfAnInterval", [](TaskConfig& task) { task.start_offset = task.interval; },
                  "below its interval of 4000000 ns"},
        BadOption{"OffsetBelowZero", [](TaskConfig& task) { task.start_offset = Duration(-1); },
                  "at least 0"},
        BadOption{"OffsetOfAFreewheelingTask",
                  [](TaskConfig& task) {
                    task.kind = TaskKind::freewheeling;
                    task.start_offset = Duration(1);
                  },
                  "only a cyclic task"},
        BadOption{"AsapOfAFreewheelingTask",
                  [](TaskConfig& task) {
                    task.kind = TaskKind::freewheeling;
                    task.late = LatePolicy::asap;
                  },
                  "only a cyclic task"},
        BadOption{"Sensitivity", [](TaskConfig& task) { task.watchdog.sensitivity = 0; }, "1 to 1000000"},
        BadOption{"OmittedCycles", [](TaskConfig& task) { task.watchdog.omitted_cycles = 1'000'001; },
                  "0 (off) to 1000000"},
        BadOption{"WatchdogTime", [](TaskConfig& task) { task.watchdog.time = Duration(-1); },
                  "4294967295 us"}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace plchost
