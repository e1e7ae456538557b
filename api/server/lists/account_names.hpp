#pragma once

#include <string>

#include <sys/types.h>

namespace plchost {

/// The name of a user or group on this host; empty: it knows none. Names that were looked up once are
/// remembered, for at most 256 of each. Control loop only.
[[nodiscard]] const std::string& user_name(uid_t user);
[[nodiscard]] const std::string& group_name(gid_t group);

}  // namespace plchost
