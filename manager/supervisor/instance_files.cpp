#include "manager/supervisor/instance_files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "manager/system/hand_over.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/access_list.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/debug_page.hpp"
#include "shm/pages/exception_history.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/variables/symbol_page.hpp"
#include "shm/variables/value_message.hpp"

namespace plchost {

namespace {

constexpr mode_t kModeBits = 07777;
constexpr mode_t kOfUsers = 01751;  // beside which users may write: each removes only the own files
constexpr mode_t kShared = 01771;   // how that is shown, or the group instead of users
constexpr mode_t kManagersOnly = 0755;

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

void tell_lack(const std::string& instance, const UserAccount& user, const Result<void>& done) {
  if (done) return;
  spdlog::error("instance {}: user {} may lack a file: {}", instance, user.number, done.error().describe());
}

void hand_over_all(const std::vector<std::string>& paths, const std::string& instance,
                   const UserAccount& user) {
  for (const std::string& path : paths) tell_lack(instance, user, hand_over(path, user));
}

// Anybody may make files beside it, so it is believed only as that of an instance.
void hand_over_retain_memory(const LeftFiles& left, const UserAccount& user) {
  const std::string path = MemoryFile::path(pool_memory_name(left.pool, retain_memory_name(left.instance)));
  tell_lack(left.instance, user, take_away(path + ".new"));
  tell_lack(left.instance, user, hand_over_believed(path, user, is_trusted_owner));
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
        debug_page_name(left.pool, left.instance), flight_page_name(left.pool, left.instance)}) {
    if (of_another(name)) MemoryFile::remove(name);
  }
  if (!of_another(outputs_page_name(left.pool, left.instance))) return;
  end_outputs_of(left.pool, left.instance);
  OutputsPage::remove(left.pool, left.instance);
}

}  // namespace

Result<void> share_with_instances(const std::string& folder, std::span<const uid_t> users) {
  const UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0)
    return failure(ErrorCode::system, "cannot open folder " + folder, errno);
  if (users.empty()) {
    if ((status.st_mode & kModeBits) != kShared || status.st_uid != ::geteuid()) return {};
    PLCHOST_TRY(let_users(fd.get(), {}, 0, kManagersOnly, folder));
    return give_rights(fd.get(), {.group = ::getegid(), .mode = kManagersOnly}, folder);
  }
  // The manager's group enters it. Of a folder with another group systemd changes the owner of all files at
  // each start.
  if (status.st_gid != ::getegid()) {
    // First the mode: files of others in it are out of reach before the group has it.
    PLCHOST_TRY(check_errno(::fchmod(fd.get(), kOfUsers), "cannot set the rights of " + folder));
    PLCHOST_TRY(give_rights(fd.get(), {.group = ::getegid(), .mode = kOfUsers}, folder));
  }
  const auto done = let_users(fd.get(), users, S_IRWXO, kOfUsers, folder);
  if (done || done.error().code != ErrorCode::unsupported) return done;
  spdlog::warn("{}; each user of group {} can make files there", done.error().describe(), ::getegid());
  return give_rights(fd.get(), {.group = ::getegid(), .mode = kShared}, folder);
}

std::vector<uid_t> users_in(const std::string& run_directory, Claims which) {
  std::vector<uid_t> users;
  std::error_code error;
  for (std::filesystem::directory_iterator at(run_directory, error), end; !error && at != end;
       at.increment(error)) {
    if (at->path().extension() != ".claim") continue;
    const auto status = plain_file(at->path());
    if (!status || is_own_or_roots(status->st_uid)) continue;
    if (which == Claims::all || is_held(at->path(), *status)) users.push_back(status->st_uid);
  }
  std::ranges::sort(users);
  users.erase(std::ranges::unique(users).begin(), users.end());
  return users;
}

void hand_over_files(const LeftFiles& left, const InstanceUser& user) {
  if (::geteuid() != 0) return;  // nobody else has had instances of another user
  const UserAccount account = account_of(user);
  const auto claims = claims_of(left);
  for (const std::string& claim : claims) {
    if (const auto owner = user_that_holds(claim); owner && *owner != account.number)
      return spdlog::error("instance {}: a process of user {} has its name", left.instance, *owner);
  }
  for (const std::string& path : {claims.front(), instance_socket_path(left.run_directory, left.instance),
                                  values_socket_path(left.run_directory, left.instance)}) {
    if (is_there_of_another(path, account.number)) ::unlink(path.c_str());
  }
  hand_over_all({exception_path(left.run_directory, left.instance),
                 kept_settings_path(left.run_directory, left.instance),
                 left.run_directory + "/" + left.instance + ".events"},
                left.instance, account);
  hand_over_retain_memory(left, account);
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

std::array<std::string, 2> claims_of(const LeftFiles& left) {
  return {instance_claim_path(left.run_directory, left.instance),
          MemoryFile::path(instance_claim_name(left.pool, left.instance))};
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
