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

/// Sets no_new_privs: this process, and all that it starts, never get more rights than it has. Set-up.
[[nodiscard]] Result<void> refuse_new_rights();
/// Whether that is so, by this process or by the one that has started it.
[[nodiscard]] bool never_gains_rights() noexcept;

}  // namespace plchost
