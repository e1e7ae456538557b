#pragma once

#include <string>

#include "shm/base/result.hpp"

namespace plchost {

/// Makes the process one of that user, for good: with the group that it has now, the user's groups and that
/// of the pool, and no_new_privs. It may take each real-time priority and lock all of its memory as before:
/// by the limits of the process, else by CAP_SYS_NICE and CAP_IPC_LOCK. It keeps no other capability.
/// Gives back what it has kept, for the log. invalid_argument: there is no such user, or it is root. refused:
/// the process may not. Before other threads are made. Set-up.
[[nodiscard]] Result<std::string> become_user_of_instances(const std::string& user, const std::string& pool);

}  // namespace plchost
