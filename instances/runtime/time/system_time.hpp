#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "instances/plc_app.h"
#include "instances/runtime/settings/settings.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The address of a symbol of the components; null if none has it.
using FindSymbol = std::function<void*(const char* symbol)>;

/// Makes the functions that [SysTime] names what SysTimeGetUs() and SysTimeGetNs() call, from here to the end
/// of the process. Empty settings: CLOCK_MONOTONIC. Without a library they are looked for in the components,
/// then in all that is loaded for everyone. `own`: SysTimeGetUs() and SysTimeGetNs() themselves, which are
/// refused. The text of an error names the symbol, the library, and what was seen. Set-up, before anything of
/// an application runs.
[[nodiscard]] Result<void> use_system_time(const SysTimeSettings& settings, std::span<const PF_SYSTIME> own,
                                           const FindSymbol& find_in_components = {});

/// The time that applications see, since a start that is the same for both. ERR_PARAMETER: `to` is null; else
/// the answer of the custom function. Any context.
[[nodiscard]] RTS_RESULT system_time_us(RTS_SYSTIME* to) noexcept;
[[nodiscard]] RTS_RESULT system_time_ns(RTS_SYSTIME* to) noexcept;

/// One function of a custom clock.
struct TimeFunction {
  std::string_view name;
  PF_SYSTIME call;
};

/// The two may differ by this much at the same moment.
inline constexpr RTS_SYSTIME kSystemTimeToleranceUs = 100;

/// Both answer ERR_OK, never go back, go on at about the pace of CLOCK_MONOTONIC, and have one base. Takes
/// about 10 ms; longer, at most about a second, where the processor is taken away, which refuses no right
/// clock.
[[nodiscard]] Result<void> check_system_time(const TimeFunction& us, const TimeFunction& ns);

}  // namespace plchost
