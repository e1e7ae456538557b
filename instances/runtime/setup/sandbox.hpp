#pragma once

#include <span>
#include <string>

#include "instances/runtime/settings/settings.hpp"
#include "shm/base/result.hpp"
#include "shm/process/system_call_filter.hpp"

namespace plchost {

/// The calls that fail once an application is loaded, and those that fail too once it starts. The page on
/// settings has each with its reason.
[[nodiscard]] std::span<const RefusedCall> calls_refused_to_load() noexcept;
[[nodiscard]] std::span<const RefusedCall> calls_refused_to_start() noexcept;

/// The result of a stage of the filter.
struct Confinement {
  std::string holds;   ///< for the log; empty: no filter was set
  std::string remark;  ///< why none was set although the settings allow one; else empty
};

/// The first stage: before code of an application is loaded, whose constructors run at once. A kernel without
/// filters keeps no application from its start, unless the settings ask for more than the default. For all
/// threads; needs refuse_new_rights(). Set-up.
[[nodiscard]] Result<Confinement> confine_to_load(Seccomp wanted);
/// The second stage: behind all of the set-up, in which the runtime and the application make their sockets.
/// Set-up.
[[nodiscard]] Result<Confinement> confine_to_start(Seccomp wanted);

}  // namespace plchost
