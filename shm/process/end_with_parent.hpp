#pragma once

#include <sys/prctl.h>
#include <sys/types.h>
#include <unistd.h>

namespace plchost {

/// From now on this process gets `signal` when `parent` ends; it is the process that has started this one.
/// False: it has ended already, and no signal comes. Any context, also between fork and exec.
[[nodiscard]] inline bool end_with_parent(pid_t parent, int signal) noexcept {
  return ::prctl(PR_SET_PDEATHSIG, signal) == 0 && ::getppid() == parent;
}

}  // namespace plchost
