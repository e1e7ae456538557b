#pragma once

#include <initializer_list>

#include "shm/base/result.hpp"

namespace plchost {

/// Takes capabilities (CAP_KILL, ... of <linux/capability.h>) from the calling thread, or all that it has. A
/// program that it starts gets none of them back where no_new_privs is set. Before other threads are made:
/// each has its own. Set-up.
[[nodiscard]] Result<void> give_up_capabilities(std::initializer_list<unsigned> given_up);
[[nodiscard]] Result<void> give_up_all_capabilities();
/// Takes all but these, and lets the thread use them. One that it does not have does not come by that.
/// Set-up.
[[nodiscard]] Result<void> keep_capabilities(std::initializer_list<unsigned> kept);

/// Whether this process, and all that it starts, never gets more rights than it has: no_new_privs.
[[nodiscard]] bool never_gains_rights() noexcept;

}  // namespace plchost
