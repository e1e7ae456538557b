#include "manager/server_files.hpp"

#include <cerrno>
#include <memory>
#include <string_view>
#include <utility>

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "manager/system/hand_over.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/log/log.hpp"
#include "shm/process/user_account.hpp"

namespace plchost {

namespace {

constexpr int kFolderFlags = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;
constexpr int kFileFlags = O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;

struct EndFolder {
  void operator()(DIR* folder) const noexcept { ::closedir(folder); }
};

mode_t mode_of(bool folder, GroupRight right) noexcept {
  if (folder) return right == GroupRight::writes ? 0770 : 0750;
  return right == GroupRight::writes ? 0660 : 0640;
}

// One that has another name as well may be anything of this user.
bool is_own(const struct stat& status) noexcept {
  const bool single = S_ISDIR(status.st_mode) || (S_ISREG(status.st_mode) && status.st_nlink == 1);
  return single && status.st_uid == ::geteuid();
}

Result<void> share(int folder, const std::string& path, GroupRight right, int depth);

Result<void> share_entry(int folder, const char* name, const std::string& path, GroupRight right, int depth) {
  const UniqueFd fd(::openat(folder, name, kFileFlags));
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0 || !is_own(status)) return {};
  if (S_ISDIR(status.st_mode)) return share(fd.get(), path, right, depth);
  return give_rights(fd.get(), {.group = ::getegid(), .mode = mode_of(false, right)}, path);
}

Result<void> share(int folder, const std::string& path, GroupRight right, int depth) {
  constexpr int kDeepest = 3;
  if (depth > 0) PLCHOST_TRY(give_rights(folder, {.group = ::getegid(), .mode = mode_of(true, right)}, path));
  if (depth == kDeepest) return {};
  const std::unique_ptr<DIR, EndFolder> entries(::fdopendir(::openat(folder, ".", kFolderFlags)));
  if (entries == nullptr) return failure(ErrorCode::system, "cannot read folder " + path, errno);
  while (const dirent* const entry = ::readdir(entries.get())) {  // NOLINT(concurrency-mt-unsafe)
    const std::string_view name = static_cast<const char*>(entry->d_name);
    if (name == "." || name == "..") continue;
    PLCHOST_TRY(share_entry(folder, entry->d_name, fmt::format("{}/{}", path, name), right, depth + 1));
  }
  return {};
}

}  // namespace

Result<void> share_folder(const std::string& path, GroupRight right, std::optional<gid_t> folders_group) {
  PLCHOST_TRY(make_synced_folders(path, S_IRWXU));
  const UniqueFd fd(::open(path.c_str(), kFolderFlags));
  if (!fd) return failure(ErrorCode::system, "cannot open folder " + path, errno);
  const gid_t group = folders_group.value_or(::getegid());
  {
    const FilesAsUser in_that_group(::geteuid(), group);  // nobody else gives a file to a group
    PLCHOST_TRY(give_rights(fd.get(), {.group = group, .mode = mode_of(true, right)}, path));
  }
  return share(fd.get(), path, right, 0);
}

// Only its user reads and writes it: it says which posts have come already.
void hand_over_ledger(const std::string& pool, const std::optional<UserAccount>& server) {
  if (::geteuid() != 0) return;
  const UserAccount user =
      server.value_or(UserAccount{.number = ::geteuid(), .group = ::getegid(), .groups = {}});
  const std::string path = MemoryFile::path(fmt::format("{}.posts", pool));
  const auto done = hand_over_believed(
      path, user, [&user](uid_t owner) { return owner == user.number || owner == ::geteuid(); });
  if (!done) spdlog::error("the API server may lack a file: {}", done.error().describe());
}

Result<void> keep_folder(const std::string& path) {
  PLCHOST_TRY(make_synced_folder(path, S_IRWXU));
  const UniqueFd fd(::open(path.c_str(), kFolderFlags));
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0)
    return failure(ErrorCode::system, "cannot open folder " + path, errno);
  const mode_t kept = status.st_mode & mode_t{S_IRWXU};
  PLCHOST_TRY(check_errno(::fchmod(fd.get(), kept), "cannot set the rights of " + path));
  return {};
}

}  // namespace plchost
