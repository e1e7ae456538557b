#pragma once

#include <filesystem>
#include <system_error>

namespace plchost {

/// The folder that this program lies in.
inline std::filesystem::path own_folder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

}  // namespace plchost
