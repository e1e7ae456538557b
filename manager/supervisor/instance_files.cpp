#include "manager/supervisor/instance_files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/debug_page.hpp"
#include "shm/pages/exception_history.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/variables/symbol_page.hpp"
#include "shm/variables/value_message.hpp"

namespace plchost {

namespace {

constexpr mode_t kModeBits = 07777;
constexpr mode_t kShared = 01771;  // each removes only the own files; others enter
constexpr mode_t kManagersOnly = 0755;
constexpr std::size_t kLargestLeft = std::size_t{32} << 20;  // a retain file has up to 16 MiB

// Nothing: it is not there, or no plain file of one name.
std::optional<struct stat> plain_file(const std::string& path) {
  struct stat status{};
  const bool plain = ::lstat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && status.st_nlink == 1;
  return plain ? std::optional(status) : std::nullopt;
}

bool is_there_of_another(const std::string& path, uid_t user) {
  struct stat status{};
  return ::lstat(path.c_str(), &status) == 0 && status.st_uid != user;
}

// Whether a process still has the claim, which only its own user can open.
bool is_held(const std::string& path, const struct stat& status) {
  const FilesAsUser rights(status.st_uid, status.st_gid);
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return fd && ::fcntl(fd.get(), F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

std::unexpected<Error> no_rights_of(uid_t user) {
  return failure(ErrorCode::refused, fmt::format("cannot open files as user {}", user));
}

Result<std::string> read_as_owner(const std::string& path, const struct stat& status) {
  const FilesAsUser rights(status.st_uid, status.st_gid);
  if (!rights.can()) return no_rights_of(status.st_uid);
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat now{};
  if (!fd || ::fstat(fd.get(), &now) != 0) return failure(ErrorCode::system, "cannot open " + path, errno);
  const auto size = static_cast<std::size_t>(now.st_size);
  if (now.st_ino != status.st_ino || size > kLargestLeft)
    return failure(ErrorCode::corrupt, path + " has changed, or is too large");
  std::string text(size, '\0');
  for (std::size_t at = 0; at < size;) {
    PLCHOST_TRY_ASSIGN(const auto got,
                       check_errno(::read(fd.get(), text.data() + at, size - at), "cannot read " + path));
    if (got == 0) return failure(ErrorCode::corrupt, path + " has changed");
    at += static_cast<std::size_t>(got);
  }
  return text;
}

Result<void> write_as(const UserAccount& user, const std::string& path, std::string_view text, mode_t mode) {
  const FilesAsUser rights(user.number, user.group);
  if (!rights.can()) return no_rights_of(user.number);
  return write_whole_file(path, text, mode);
}

// The old one is there until the new one is whole.
Result<void> hand_over(const std::string& path, const UserAccount& user) {
  const auto before = plain_file(path);
  if (!before || before->st_uid == user.number) return {};
  PLCHOST_TRY_ASSIGN(const auto text, read_as_owner(path, *before));
  const std::string fresh = path + ".new";
  ::unlink(fresh.c_str());
  auto written = write_as(user, fresh, text, before->st_mode & 0777U);
  if (written && ::rename(fresh.c_str(), path.c_str()) != 0)
    written = failure(ErrorCode::system, "cannot rename " + fresh, errno);
  if (!written) ::unlink(fresh.c_str());
  return written;
}

void hand_over_all(const std::vector<std::string>& paths, const std::string& instance,
                   const UserAccount& user) {
  for (const std::string& path : paths) {
    const auto done = hand_over(path, user);
    if (!done)
      spdlog::error("instance {}: user {} may lack a file: {}", instance, user.number,
                    done.error().describe());
  }
}

UserAccount account_of(const InstanceUser& user) {
  return user.value_or(UserAccount{.number = ::geteuid(), .group = ::getegid(), .groups = {}});
}

void remove_pages_of_others(const LeftFiles& left, uid_t user) {
  const auto of_another = [user](const std::string& name) {
    return is_there_of_another(MemoryFile::path(name), user);
  };
  const std::string claim = MemoryFile::path(instance_claim_name(left.pool, left.instance));
  if (const auto status = plain_file(claim); status && status->st_uid != user && !is_held(claim, *status)) {
    ::unlink(claim.c_str());
  }
  for (const std::string& name :
       {instance_page_name(left.pool, left.instance), symbol_page_name(left.pool, left.instance),
        debug_page_name(left.pool, left.instance)}) {
    if (of_another(name)) MemoryFile::remove(name);
  }
  if (!of_another(outputs_page_name(left.pool, left.instance))) return;
  end_outputs_of(left.pool, left.instance);
  OutputsPage::remove(left.pool, left.instance);
}

}  // namespace

Result<void> share_with_instances(const std::string& folder, const InstanceUser& user) {
  const UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0)
    return failure(ErrorCode::system, "cannot open folder " + folder, errno);
  if (!user) {
    if ((status.st_mode & kModeBits) != kShared || status.st_uid != ::geteuid()) return {};
    return give_rights(fd.get(), {.group = ::getegid(), .mode = kManagersOnly}, folder);
  }
  // The manager's group, which instances have, too. Of a folder with another group systemd changes the owner
  // of all files at each start.
  if ((status.st_mode & kModeBits) == kShared && status.st_gid == ::getegid()) return {};
  // First the mode: files of others in it are out of reach before the group has it.
  PLCHOST_TRY(
      check_errno(::fchmod(fd.get(), kShared & ~mode_t{S_IWGRP}), "cannot set the rights of " + folder));
  return give_rights(fd.get(), {.group = ::getegid(), .mode = kShared}, folder);
}

std::vector<uid_t> users_in(const std::string& run_directory) {
  std::vector<uid_t> users;
  std::error_code error;
  for (std::filesystem::directory_iterator at(run_directory, error), end; !error && at != end;
       at.increment(error)) {
    if (at->path().extension() != ".claim") continue;
    const auto status = plain_file(at->path());
    if (status && !is_own_or_roots(status->st_uid)) users.push_back(status->st_uid);
  }
  std::ranges::sort(users);
  users.erase(std::ranges::unique(users).begin(), users.end());
  return users;
}

void hand_over_files(const LeftFiles& left, const InstanceUser& user) {
  if (::geteuid() != 0) return;  // nobody else has had instances of another user
  const UserAccount account = account_of(user);
  const std::string stem = left.run_directory + "/" + left.instance;
  const std::string claim = stem + ".claim";
  const auto claimed = plain_file(claim);
  if (claimed && claimed->st_uid != account.number && is_held(claim, *claimed)) {
    spdlog::error("instance {}: a process of user {} has its name", left.instance, claimed->st_uid);
    return;
  }
  for (const std::string& path : {claim, instance_socket_path(left.run_directory, left.instance),
                                  values_socket_path(left.run_directory, left.instance)}) {
    if (is_there_of_another(path, account.number)) ::unlink(path.c_str());
  }
  hand_over_all({exception_path(left.run_directory, left.instance),
                 kept_settings_path(left.run_directory, left.instance), stem + ".events"},
                left.instance, account);
  remove_pages_of_others(left, account.number);
}

void hand_over_retain_files(const std::string& state_directory, const std::string& instance,
                            const InstanceUser& user) {
  if (::geteuid() != 0) return;
  const UserAccount account = account_of(user);
  const std::string stem = fmt::format("{}/{}.retain", state_directory, instance);
  const std::string lock = stem + ".lock";
  const auto status = plain_file(lock);
  if (status && status->st_uid != account.number && !is_held(lock, *status)) ::unlink(lock.c_str());
  hand_over_all({stem + ".0", stem + ".1", stem + ".0.old", stem + ".1.old"}, instance, account);
  for (const char* end : {".0.new", ".1.new"}) {
    if (is_there_of_another(stem + end, account.number)) ::unlink((stem + end).c_str());
  }
}

std::optional<uid_t> user_that_holds(const std::string& path) {
  const auto file = plain_file(path);
  return file && is_held(path, *file) ? std::optional(file->st_uid) : std::nullopt;
}

void put_folder_aside(const std::string& path) {
  struct stat status{};
  if (::lstat(path.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) return;
  // A name that nobody can have taken before.
  const std::string aside = fmt::format("{}.old.{}", path, MonotonicClock::now().time_since_epoch().count());
  const auto renamed =
      check_errno(::renameat2(AT_FDCWD, path.c_str(), AT_FDCWD, aside.c_str(), RENAME_NOREPLACE),
                  "cannot rename folder " + path);
  if (!renamed) return spdlog::error("{}", renamed.error().describe());
  spdlog::warn("{} was a folder of user {}; it is renamed to {}", path, status.st_uid, aside);
}

void end_outputs_of(const std::string& pool, const std::string& instance) {
  const std::string path = MemoryFile::path(outputs_page_name(pool, instance));
  const auto page = plain_file(path);
  if (!page || is_own_or_roots(page->st_uid) || !is_trusted_owner(page->st_uid)) {
    return end_outputs(pool, instance, is_own_or_roots);  // not what that user has put there meanwhile
  }
  const FilesAsUser rights(page->st_uid, page->st_gid);
  if (!rights.can()) {
    return spdlog::warn("instance {}: its outputs stay as they are: {}", instance,
                        no_rights_of(page->st_uid).error().describe());
  }
  end_outputs(pool, instance, [&page](uid_t owner) { return owner == page->st_uid; });
}

}  // namespace plchost
