#pragma once

#include <string>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// Files and folders, with all that is in them. One that is not there is left out.
struct FileView {
  std::vector<std::string> read;   ///< to read only
  std::vector<std::string> write;  ///< also to write, make and remove files
};

/// From now on the process, with threads that are made later, opens no other files, and starts no program.
/// Open descriptors stay. Needs no_new_privs. unavailable: this kernel has no Landlock, and nothing is
/// restricted. Set-up.
[[nodiscard]] Result<void> restrict_files(const FileView& view);

}  // namespace plchost
