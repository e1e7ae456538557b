#pragma once

#include <cstdint>
#include <string>

#include <sys/stat.h>
#include <sys/types.h>

namespace plchost {

/// Tells one version of a file that is replaced as a whole from another.
struct FileVersion {
  ino_t inode = 0;  ///< 0: there is no file
  off_t size = 0;
  std::int64_t changed_ns = 0;
  bool operator==(const FileVersion&) const = default;

  /// Follows no link: another user may have put one there. Set-up.
  [[nodiscard]] static FileVersion of(const std::string& path) noexcept {
    struct stat status{};
    if (::lstat(path.c_str(), &status) != 0) return {};
    constexpr std::int64_t kPerSecond = 1'000'000'000;
    return {.inode = status.st_ino,
            .size = status.st_size,
            .changed_ns = status.st_mtim.tv_sec * kPerSecond + status.st_mtim.tv_nsec};
  }
};

}  // namespace plchost
