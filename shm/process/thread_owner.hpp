#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace plchost {

/// The process that a thread belongs to.
struct ThreadOwner {
  std::uint32_t pid = 0;
  std::string program;  ///< the first 15 bytes of its name
};
/// Nothing: there is no such thread (any more). Reads two files of /proc.
[[nodiscard]] std::optional<ThreadOwner> owner_of_thread(std::uint32_t thread);

}  // namespace plchost
