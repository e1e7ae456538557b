// An application's reports of a reference clock, and the answers.
#include <array>
#include <cstring>

#include <gtest/gtest.h>

#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/tasks/task_builder.hpp"
#include "instances/runtime/time/reference.hpp"
#include "tests/support/manual_clock.hpp"
#include "tests/support/simulated_reference.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

ManualClock* the_clock = nullptr;
SimulatedReference* the_reference = nullptr;
RTS_RESULT last_report = ERR_OK;

void bus_cycle() {
  const ReferencePair pair = the_reference->stamp(the_clock->now());
  last_report = SchedReportReferenceTime(pair.reference_ns, pair.local.time_since_epoch().count());
}

class ClockCalls : public testing::Test {
 protected:
  ClockCalls() {
    the_clock = &clock;
    the_reference = &reference;
    fill(infos_[0], "Report", 20, 100, [] {});
    fill(infos_[1], "Bus", 0, 1, bus_cycle);
    setup_.nTasks = 2;
    setup_.ptaskinfo = infos_.data();
    host.begin_init(declaration_);
    __sys__setup__tasks(&setup_);
    host.end_init();
  }
  ~ClockCalls() override {
    if (tasks && tasks->running()) (void)tasks->stop(Duration::zero());
    clock.run_for(std::chrono::seconds(1));
    host.task_table().attach(nullptr);
  }
  ClockCalls(const ClockCalls&) = delete;
  ClockCalls& operator=(const ClockCalls&) = delete;

  static void fill(Task_Info& info, const char* name, short priority, unsigned interval_ms,
                   PLC_TASK_FUNCTION run) {
    std::strncpy(info.stName, name, sizeof info.stName - 1);
    info.KindOfTask = Cyclic;
    info.nPriority = priority;
    info.dwInterval = interval_ms;
    info.dwTaskEntryFunctionPointer = run;
  }
  void make_tasks() {
    TaskEnvironment environment;
    environment.find_event = [](std::string_view) -> Result<CountedEvent*> { return nullptr; };
    environment.statistics = [this](std::size_t index) -> TaskStatistics& { return statistics_[index]; };
    environment.allow_unprivileged = true;
    auto made = TaskSet::create(clock, PriorityBand::normal, build_tasks(setup_).value(), environment);
    ASSERT_TRUE(made) << made.error().describe();
    tasks = *std::move(made);
    host.task_table().attach(tasks.get());
  }
  static Clock_State state_of(RTS_HANDLE task) {
    Clock_State state{};
    state.dwSize = sizeof state;
    EXPECT_EQ(SchedGetClockState(task, &state), ERR_OK);
    return state;
  }

  ManualClock clock;
  SimulatedReference reference{clock.now() + std::chrono::microseconds(123), -50e-6, 100};
  ApplicationHost host{"test", nullptr};
  ApplicationDeclaration declaration_;
  std::array<Task_Info, 2> infos_{};
  sys_setup_tasks_struct setup_{};
  std::array<TaskStatistics, 2> statistics_;
  std::unique_ptr<TaskSet> tasks;
};

TEST_F(ClockCalls, DriverInTheApplicationLocksTheGridsToItsBus) {
  make_tasks();
  EXPECT_EQ(state_of(RTS_INVALID_HANDLE).dwState, PLC_CLOCK_OFF);
  ASSERT_TRUE(tasks->start("CmpScheduleOneShot", {}));
  clock.run_for(milliseconds(1000));
  EXPECT_EQ(last_report, ERR_OK);
  const Clock_State state = state_of(RTS_INVALID_HANDLE);
  EXPECT_EQ(state.dwState, PLC_CLOCK_LOCKED);
  EXPECT_EQ(state.bInSync, 1);
  EXPECT_NEAR(static_cast<double>(state.nDriftPpb), -50'000, 2000);
  EXPECT_LT(std::abs(state.nOffsetNs), 200);
  EXPECT_GT(state.qwPairs, 900U);
  EXPECT_EQ(state.qwRejected, 0U);
  EXPECT_EQ(state.dwSize, sizeof state);
  EXPECT_EQ(state_of(SchedGetTaskHandle("Bus", nullptr)).bInSync, 1);
  EXPECT_EQ(state_of(SchedGetTaskHandle("Report", nullptr)).bInSync, 0) << "it had only ten releases";
}

TEST_F(ClockCalls, RefuseWhatIsWrong) {
  Clock_State state{};
  state.dwSize = sizeof state;
  EXPECT_EQ(SchedReportReferenceTime(1, 1), ERR_NOTINITIALIZED);
  EXPECT_EQ(SchedGetClockState(RTS_INVALID_HANDLE, &state), ERR_NOTINITIALIZED);
  make_tasks();
  EXPECT_EQ(SchedGetClockState(RTS_INVALID_HANDLE, nullptr), ERR_PARAMETER);
  EXPECT_EQ(SchedGetClockState(nullptr, &state), ERR_PARAMETER);
  state.dwSize = 0;
  EXPECT_EQ(SchedGetClockState(RTS_INVALID_HANDLE, &state), ERR_PARAMETER);
}

TEST_F(ClockCalls, WriteNoMoreThanTheCallerHasRoomFor) {
  make_tasks();
  Clock_State state{};
  state.dwSize = 8;
  state.nDriftPpb = -7;
  EXPECT_EQ(SchedGetClockState(RTS_INVALID_HANDLE, &state), ERR_OK);
  EXPECT_EQ(state.nDriftPpb, -7);
}

TEST_F(ClockCalls, ReportIsRefusedWhileARecordIsFollowed) {
  make_tasks();
  FakeRecord record;
  ASSERT_TRUE(tasks->distributed_clock().use_source(&record));
  EXPECT_EQ(SchedReportReferenceTime(1, 1), ERR_DUPLICATE);
  ASSERT_TRUE(tasks->distributed_clock().use_source(nullptr));
}

}  // namespace
}  // namespace plchost
