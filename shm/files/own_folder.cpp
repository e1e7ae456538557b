#include "shm/files/own_folder.hpp"

#include <cerrno>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace plchost {

Result<void> check_own_folder(const std::string& path) {
  struct stat status{};
  if (::stat(path.c_str(), &status) != 0) {
    const int error = errno;
    return failure(error == ENOENT ? ErrorCode::not_found : ErrorCode::system, "cannot examine " + path,
                   error);
  }
  const bool trusted = status.st_uid == 0 || status.st_uid == ::geteuid();
  if (trusted && (status.st_mode & S_IWOTH) == 0) return {};
  return failure(
      ErrorCode::refused,
      fmt::format("{} (owner {}, mode {:04o}): other users can put files into it; use another folder, or "
                  "change its owner and mode",
                  path, status.st_uid, status.st_mode & 07777U));
}

}  // namespace plchost
