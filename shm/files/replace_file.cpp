#include "shm/files/replace_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

// "/x/retain/" lies in "/x".
std::string without_last_slash(const std::string& path) {
  const std::filesystem::path folder(path);
  return folder.has_filename() ? path : folder.parent_path().string();
}

}  // namespace

Result<void> write_whole_file(const std::string& path, std::string_view text, mode_t mode) {
  // A left-over of a run before this one may have other rights.
  if (::unlink(path.c_str()) != 0 && errno != ENOENT)
    return failure(ErrorCode::system, "cannot remove " + path, errno);
  const UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (!fd) return failure(ErrorCode::system, "cannot open " + path, errno);
  while (!text.empty()) {
    PLCHOST_TRY_ASSIGN(const auto written,
                       check_errno(::write(fd.get(), text.data(), text.size()), "cannot write " + path));
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  PLCHOST_TRY(check_errno(::fsync(fd.get()), "cannot sync " + path));
  return {};
}

Result<void> sync_directory(const std::string& path) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd) return failure(ErrorCode::system, "cannot open " + path, errno);
  PLCHOST_TRY(check_errno(::fsync(fd.get()), "cannot sync " + path));
  return {};
}

Result<void> make_synced_folder(const std::string& path, mode_t mode) {
  const std::string folder = without_last_slash(path);
  const std::filesystem::path above = std::filesystem::path(folder).parent_path();
  const bool made = ::mkdir(folder.c_str(), mode) == 0;
  if (!made && errno != EEXIST) return failure(ErrorCode::system, "cannot create folder " + folder, errno);
  // One that was there is synced as well: the process that made it may have been killed before it did. Not
  // every user of a folder may read the one above it, and some that are only read cannot be synced.
  auto synced = sync_directory(above.empty() ? "." : above.string());
  constexpr std::array kOfOthers = {EACCES, EINVAL, EROFS};
  const bool tolerated =
      !made && !synced && std::ranges::find(kOfOthers, synced.error().system_errno) != kOfOthers.end();
  return tolerated ? Result<void>() : synced;
}

Result<void> make_synced_folders(const std::string& path, mode_t mode) {
  constexpr mode_t kModeOfOthers = 0777;
  const std::filesystem::path folder(without_last_slash(path));
  const std::filesystem::path above = folder.parent_path();
  std::error_code error;
  if (!above.empty() && !std::filesystem::exists(above, error)) {
    PLCHOST_TRY(make_synced_folders(above, kModeOfOthers));
  }
  return make_synced_folder(folder, mode);
}

Result<void> replace_file(const std::string& path, std::string_view text, mode_t mode) {
  const std::string fresh = path + ".new";
  if (auto written = write_whole_file(fresh, text, mode); !written) {
    ::unlink(fresh.c_str());  // half a file only takes room, of which there may be too little
    return written;
  }
  std::error_code error;
  std::filesystem::rename(fresh, path, error);
  if (!error) return {};
  ::unlink(fresh.c_str());
  return failure(ErrorCode::system, "cannot rename " + fresh, error.value());
}

}  // namespace plchost
