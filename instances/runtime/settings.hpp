#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "schedulers/scheduler.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// What an instance's own settings file says, validated.
///
///   [CmpSchedule]       SchedulerInterval=1000          us, the tick and the poll of event variables
///                       Task.Freewheeling.Cycletime=10  ms, fixed sleep of freewheeling tasks
///                       ProcessorLoad.Maximum=60        percent; freewheeling tasks sleep the rest
///                       SpinAhead.MaxUs=100             us, bound of the guard of CmpScheduleOneShot; 0: off
///                       ExternalEvent.MaxBacklog=1048576
///   [SysTimer]          VxWorks.TimerSource=System      or Task; Linux.TimerSource is the same key
///   [ComponentManager]  Component.1=driver.so           loaded in the order of the numbers
///
/// Other sections belong to other programs: they are listed and left alone.
struct InstanceSettings {
  SchedulerSettings scheduler;
  std::vector<std::string> components;  ///< in order; a relative path counts from the settings file's folder
  std::vector<std::string> foreign_sections;
};

inline constexpr std::size_t kMaxSettingsFile = std::size_t{1} << 20;
/// The longest line of a settings file, in bytes: inih's own bound.
inline constexpr std::size_t kMaxSettingsLine = 198;
inline constexpr std::size_t kMaxComponents = 64;

/// `file` is how errors call it: "FILE:LINE: what is wrong, and what is allowed".
[[nodiscard]] Result<InstanceSettings> parse_settings(std::string_view text, std::string_view file);

/// not_found: no such file. Set-up.
[[nodiscard]] Result<InstanceSettings> read_settings(const std::string& file);

}  // namespace plchost
