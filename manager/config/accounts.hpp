#pragma once

#include <string>

#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost {

/// The number of a user, or of a group, of this host, given by name or by number ("plc", "1000").
/// invalid_argument: it is neither. Set-up: may ask a directory service.
[[nodiscard]] Result<uid_t> user_number(const std::string& text);
[[nodiscard]] Result<gid_t> group_number(const std::string& text);

/// "0660": three or four octal digits. invalid_argument: something else, or bits that a shared memory has no
/// use for (allowed are 0666), or its owner could not read and write it.
[[nodiscard]] Result<mode_t> parse_mode(const std::string& text);

}  // namespace plchost
