// The calls of applications about the distributed clock and the system time: see plc_app.h.
#include <algorithm>
#include <cstring>
#include <utility>

#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/time/system_time.hpp"

using plchost::ApplicationHost;
using plchost::ClockFollower;
using plchost::ClockState;
using plchost::ClockStatus;
using plchost::Duration;
using plchost::Task;
using plchost::TaskSet;
using plchost::TimePoint;

static_assert(PLC_CLOCK_OFF == std::to_underlying(ClockState::off) &&
              PLC_CLOCK_FREE_RUNNING == std::to_underlying(ClockState::free_running) &&
              PLC_CLOCK_ACQUIRING == std::to_underlying(ClockState::acquiring) &&
              PLC_CLOCK_LOCKED == std::to_underlying(ClockState::locked) &&
              PLC_CLOCK_HOLD_OVER == std::to_underlying(ClockState::hold_over) &&
              PLC_CLOCK_MEASURING == std::to_underlying(ClockState::measuring));

namespace {

TaskSet* tasks_of_host() noexcept {
  ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr || host->in_init() ? nullptr : host->task_table().tasks();
}

}  // namespace

RTS_RESULT SchedReportReferenceTime(RTS_I64 nReferenceNs, RTS_I64 nLocalNs) {
  TaskSet* const tasks = tasks_of_host();
  if (tasks == nullptr) return ERR_NOTINITIALIZED;
  const bool taken = tasks->distributed_clock().report(
      {.local = TimePoint(Duration(nLocalNs)), .reference_ns = nReferenceNs});
  return taken ? ERR_OK : ERR_DUPLICATE;
}

RTS_RESULT SchedGetClockState(RTS_HANDLE hTask, Clock_State* pState) {
  TaskSet* const tasks = tasks_of_host();
  if (tasks == nullptr) return ERR_NOTINITIALIZED;
  if (pState == nullptr || pState->dwSize < sizeof pState->dwSize) return ERR_PARAMETER;
  const ClockFollower* follower = tasks->distributed_clock().leading();
  if (hTask != RTS_INVALID_HANDLE) {
    const Task* const task = ApplicationHost::current()->task_table().task(hTask);
    follower = task == nullptr ? nullptr : task->follower();
  }
  if (follower == nullptr) return ERR_PARAMETER;
  const ClockStatus status = tasks->distributed_clock().status(*follower);
  Clock_State state{};
  state.dwSize = pState->dwSize;
  state.dwState = std::to_underlying(status.state);
  state.bInSync = status.in_sync ? 1 : 0;
  state.nOffsetNs = status.offset_ns;
  state.nDriftPpb = status.drift_ppb;
  state.nCorrectionNs = status.correction_ns;
  state.qwPairs = status.pairs;
  state.qwRejected = status.rejected + status.invalid;
  state.qwSteps = status.steps;
  // A program that was built with an older file knows less of it.
  std::memcpy(pState, &state, std::min<std::size_t>(state.dwSize, sizeof state));
  return ERR_OK;
}

RTS_RESULT SysTimeGetUs(RTS_SYSTIME* pTime) {
  return plchost::system_time_us(pTime);
}

RTS_RESULT SysTimeGetNs(RTS_SYSTIME* pTime) {
  return plchost::system_time_ns(pTime);
}

unsigned int SysTimeGetMs() {
  constexpr RTS_SYSTIME kNsPerMs = 1'000'000;
  RTS_SYSTIME ns = 0;
  (void)plchost::system_time_ns(&ns);
  return static_cast<unsigned int>(ns / kNsPerMs);
}
