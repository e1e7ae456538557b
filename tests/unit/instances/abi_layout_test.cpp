// The layout that compiled applications rely on: a change here is a new PLC_APP_ABI_VERSION.
#include <cstddef>
#include <utility>

#include <gtest/gtest.h>

#include "instances/plc_app.h"
#include "shm/base/task_kind.hpp"

namespace {

static_assert(PLC_APP_ABI_VERSION == 1);
static_assert(offsetof(Task_Info, stName) == 0);
static_assert(offsetof(Task_Info, nPriority) == 52);
static_assert(offsetof(Task_Info, KindOfTask) == 54);
static_assert(offsetof(Task_Info, bMicroseconds) == 56);
static_assert(offsetof(Task_Info, dwInterval) == 60);
static_assert(offsetof(Task_Info, dwEventFunctionPointer) == 64);
static_assert(offsetof(Task_Info, stExternalEvent) == 72);
static_assert(offsetof(Task_Info, dwTaskEntryFunctionPointer) == 128);
static_assert(offsetof(Task_Info, tLastCycleTime) == 136);
static_assert(offsetof(Task_Info, tAverageCycleTime) == 140);
static_assert(offsetof(Task_Info, tMaxCycleTime) == 144);
static_assert(offsetof(Task_Info, tMinCycleTime) == 148);
static_assert(offsetof(Task_Info, tJitterMax) == 152);
static_assert(offsetof(Task_Info, tJitterLast) == 156);
static_assert(sizeof(Task_Info) == 160);
static_assert(offsetof(sys_setup_tasks_struct, nTasks) == 0);
static_assert(offsetof(sys_setup_tasks_struct, stApplicationName) == 2);
static_assert(offsetof(sys_setup_tasks_struct, ptaskinfo) == 56);
static_assert(sizeof(sys_setup_tasks_struct) == 64);
static_assert(sizeof(RTS_I64) == 8 && sizeof(RTS_UI64) == 8);
static_assert(offsetof(Task_Options, dwSize) == 0);
static_assert(offsetof(Task_Options, nStartOffsetNs) == 8);
static_assert(offsetof(Task_Options, nLatePolicy) == 16);
static_assert(offsetof(Task_Options, bDrivesOutputs) == 18);
static_assert(offsetof(Task_Options, dwWatchdogTimeUs) == 20);
static_assert(offsetof(Task_Options, dwWatchdogSensitivity) == 24);
static_assert(offsetof(Task_Options, dwWatchdogOmittedCycles) == 28);
static_assert(offsetof(Task_Options, nWatchdogPolicy) == 32);
static_assert(sizeof(Task_Options) == 40);
static_assert(offsetof(Plc_Area_Use, dwOffset) == 8 && offsetof(Plc_Area_Use, dwBytes) == 12);
static_assert(offsetof(Plc_Area_Use, ppAddress) == 16 && sizeof(Plc_Area_Use) == 24);
static_assert(offsetof(Plc_Area, dwFlags) == 4 && offsetof(Plc_Area, pszName) == 8);
static_assert(offsetof(Plc_Area, dwBytes) == 16 && offsetof(Plc_Area, nUses) == 20);
static_assert(offsetof(Plc_Area, pUses) == 24 && offsetof(Plc_Area, pInitial) == 32);
static_assert(offsetof(Plc_Area, qwLayout) == 40 && offsetof(Plc_Area, ppAddress) == 48);
static_assert(sizeof(Plc_Area) == 56);
static_assert(offsetof(Plc_Area_State, dwOrigin) == 4 && offsetof(Plc_Area_State, qwImages) == 8);
static_assert(offsetof(Plc_Area_State, qwUnsaved) == 32 && sizeof(Plc_Area_State) == 40);

// The first four are the seed's.
TEST(Abi, NumbersTheKindsOfTaskAsTheRuntimeDoes) {
  EXPECT_EQ(Cyclic, 0);
  EXPECT_EQ(Event, 1);
  EXPECT_EQ(External, 2);
  EXPECT_EQ(Freewheeling, 3);
  using plchost::TaskKind;
  EXPECT_EQ(Cyclic, std::to_underlying(TaskKind::cyclic));
  EXPECT_EQ(Event, std::to_underlying(TaskKind::event));
  EXPECT_EQ(External, std::to_underlying(TaskKind::external));
  EXPECT_EQ(Freewheeling, std::to_underlying(TaskKind::freewheeling));
}

}  // namespace
