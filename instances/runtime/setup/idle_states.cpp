#include "instances/runtime/setup/idle_states.hpp"

#include <cstdint>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

Result<UniqueFd> open_at_zero(const std::string& device) {
  UniqueFd fd(::open(device.c_str(), O_WRONLY | O_CLOEXEC));
  if (!fd) return failure(ErrorCode::refused, "cannot open " + device, errno);
  const std::int32_t microseconds = 0;
  PLCHOST_TRY(check_errno(::write(fd.get(), &microseconds, sizeof microseconds), "cannot write " + device));
  return fd;
}

Result<std::vector<CoreLatencyHold>> hold_each(const std::vector<int>& cores,
                                               const std::string& run_directory, const std::string& sysfs) {
  if (run_directory.empty()) {
    return failure(ErrorCode::unsupported, "there is no run directory to write down what was before");
  }
  std::vector<CoreLatencyHold> holds;
  for (const int core : cores) {
    PLCHOST_TRY_ASSIGN(auto hold, CoreLatencyHold::take(sysfs, run_directory, core));
    holds.push_back(std::move(hold));
  }
  return holds;
}

}  // namespace

IdleHold IdleHold::take(IdleStates wanted, const std::vector<int>& cores, const std::string& run_directory,
                        const Files& files) {
  IdleHold hold;
  if (!run_directory.empty()) {
    // The left-over of an instance that was killed before us; where there is a manager, it has done this
    // already.
    const auto restored = restore_core_latency(files.sysfs, run_directory);
    for (const std::string& line : restored.value_or(std::vector<std::string>())) spdlog::info("{}", line);
  }
  if (wanted == IdleStates::allow) return hold;
  if (wanted == IdleStates::hold) {
    hold.hold_all(files.device);
    return hold;
  }
  auto each = hold_each(cores, run_directory, files.sysfs);
  if (each) {
    hold.cores_ = *std::move(each);
    hold.status_ = fmt::format("held for core {}", fmt::join(cores, ","));
    return hold;
  }
  hold.hold_all(files.device);
  hold.as_wanted_ = false;
  hold.status_ += fmt::format("; not for each core: {}", each.error().describe());
  return hold;
}

void IdleHold::hold_all(const std::string& device) {
  auto opened = open_at_zero(device);
  if (opened) {
    device_ = *std::move(opened);
    status_ = "held for all cores";
  } else {
    status_ = fmt::format("not held: {}", opened.error().describe());
    as_wanted_ = false;
  }
}

}  // namespace plchost
