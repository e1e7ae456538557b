#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "schedulers/settings/scheduler_settings.hpp"
#include "schedulers/settings/task_options.hpp"
#include "shm/base/task_statistics.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// [SysTimer] TimerMode: one_shot is the seed's way to ask for distributed clocks.
enum class TimerMode : std::uint8_t { periodic, one_shot };
/// The scheduler of an instance for which none is named.
[[nodiscard]] constexpr std::string_view scheduler_of(TimerMode mode) noexcept {
  return mode == TimerMode::one_shot ? "CmpScheduleOneShot" : "CmpSchedule";
}

/// [SysTimer] IdleStates: the way to hold the processor out of its slow sleep states while the instance runs.
enum class IdleStates : std::uint8_t {
  hold,       ///< /dev/cpu_dma_latency at 0, for all cores
  hold_core,  ///< only for the instance's own core, where the kernel offers it
  allow,      ///< nothing
};

/// [Sandbox] Seccomp: the system calls that the process gives up. Each word holds all that the one before
/// does.
enum class Seccomp : std::uint8_t {
  off,         ///< none
  no_exec,     ///< before the application is loaded: programs, other processes, the kernel
  no_sockets,  ///< before the application starts: new sockets
};

/// [SysTime]: the clock that applications see, if it is not CLOCK_MONOTONIC. Both functions or none.
struct SysTimeSettings {
  std::string get_us;   ///< the symbol of a function like SysTimeGetUs
  std::string get_ns;   ///< the symbol of a function like SysTimeGetNs
  std::string library;  ///< the file that holds both; empty: a component, or what else is loaded
  bool operator==(const SysTimeSettings&) const = default;
};

/// [CmpBlkDrvShm] and [CmpRouter]: the instance as a node that talks to others.
struct BlockSettings {
  bool enable = false;               ///< a node from the start, also without a channel
  std::string base = "blocks";       ///< nodes of the same base name in the same pool see each other
  std::uint16_t forced_address = 0;  ///< 0: any
  std::uint32_t queue_slots = 1024;  ///< of each queue of the links that it makes
  Duration hold = std::chrono::seconds(1);
  std::vector<std::string> neighbours;  ///< empty: all
  bool forward = true;
  std::uint8_t hop_limit = 8;
  bool operator==(const BlockSettings&) const = default;
};

/// The options of one task, by a [Task.NAME] section of the settings or by a call of plc_set_task_options().
/// Those that it does not name stay as they are.
struct TaskSettings {
  std::string task;
  std::string where;  ///< how errors call it: "line1.cfg:12: [Task.Fast]"
  std::optional<LatePolicy> late{};
  std::optional<Duration> start_offset{};
  std::optional<bool> drives_outputs{};
  std::optional<Duration> watchdog_time{};
  std::optional<std::uint32_t> watchdog_sensitivity{};
  std::optional<std::uint32_t> watchdog_omitted_cycles{};
  std::optional<WatchdogPolicy> watchdog_policy{};
  bool operator==(const TaskSettings&) const = default;
};

/// [SysMem] Area.N.SafeState: the outputs of an area while no task drives them.
enum class SafeState : std::uint8_t {
  keep,    ///< as they were put out last
  zero,    ///< all bytes 0
  values,  ///< given ones
  unsaid,  ///< as keep, but terminals go by their age
};
/// Whether they are other ones then.
[[nodiscard]] constexpr bool changes_outputs(SafeState safe) noexcept {
  return safe == SafeState::zero || safe == SafeState::values;
}

/// [SysMem] Area.N: where application areas of these flags lie.
struct AreaSettings {
  std::size_t number = 0;
  std::uint32_t flags = 0;    ///< as in plc_app.h: PLC_AREA_...
  std::uint64_t address = 0;  ///< offset in the device or file; a multiple of kAreaAlignment
  std::uint64_t size = 0;     ///< bytes
  std::string device;         ///< empty: `object` says where it is
  std::string object;         ///< a shared memory of the pool
  SafeState safe = SafeState::unsaid;
  std::vector<std::byte> safe_values{};  ///< of SafeState::values: `size` bytes
  std::string where;                     ///< "line1.cfg:12", its first line
  bool operator==(const AreaSettings&) const = default;
};

/// [Retain] Mismatch: the treatment of retain values that belong to another layout of the retain areas.
enum class RetainMismatch : std::uint8_t {
  initialise,  ///< all areas begin with their initial values; the file is put aside
  refuse,      ///< the application is not loaded
  ignore,      ///< areas of the same name get their bytes, as many as both have
};

/// [Retain]: where and how often retain and persistent variables are written.
struct RetainSettings {
  std::string directory;  ///< empty: the one that the instance was started with
  Duration interval = std::chrono::seconds(1);
  RetainMismatch mismatch = RetainMismatch::initialise;
  Duration postpone = std::chrono::milliseconds(100);
  bool operator==(const RetainSettings&) const = default;
};

/// [Application]: texts for the application, by their names.
using Parameters = std::map<std::string, std::string, std::less<>>;

/// The values of an instance's own settings file, validated. instances/settings.md lists the keys.
struct InstanceSettings {
  SchedulerSettings scheduler;
  StopLimits stop;
  TimerMode timer_mode = TimerMode::periodic;
  IdleStates idle_states = IdleStates::hold;
  Seccomp seccomp = Seccomp::no_exec;
  SysTimeSettings sys_time;
  BlockSettings blocks;
  std::string device_description;   ///< file; empty: none, and any external event is allowed
  std::vector<TaskSettings> tasks;  ///< one for each [Task.NAME]
  std::vector<AreaSettings> areas;  ///< [SysMem], in the order of their numbers: 0, 1, ...
  RetainSettings retain;
  std::uint32_t fine_tasks = kMaxFineTasks;  ///< up to so many tasks have histograms of 3 digits
  Parameters parameters;                     ///< [Application] Parameter.NAME
  std::vector<std::string> components;  ///< in order; a relative path counts from the settings file's folder

  /// The ignored parts: sections and components of other programs, each once; and keys without a meaning
  /// here, with their place.
  std::vector<std::string> foreign_sections;
  std::vector<std::string> foreign_components;
  std::vector<std::string> remarks;
  bool operator==(const InstanceSettings&) const = default;
};

inline constexpr std::size_t kMaxComponents = 999;
inline constexpr std::size_t kMaxParameters = 256;
inline constexpr std::size_t kMaxParameterName = 50;
inline constexpr std::size_t kMaxParameterText = 500;  ///< bytes
inline constexpr std::size_t kMaxAreas = 64;
inline constexpr std::uint64_t kMaxAreaSize = std::uint64_t{1} << 30;
inline constexpr std::uint64_t kAreaAlignment = 8;
/// Files that refer to each other: so many behind the first, and in all.
inline constexpr std::size_t kMaxReferenceDepth = 8;
inline constexpr std::size_t kMaxSettingsFiles = 64;

}  // namespace plchost
