#include "shm/files/memory_rights.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <vector>

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

bool caller_is_in(gid_t group) {
  if (::getegid() == group) return true;
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(::getgroups(0, nullptr), 0)));
  const int count = ::getgroups(static_cast<int>(groups.size()), groups.data());
  groups.resize(static_cast<std::size_t>(std::max(count, 0)));
  return std::ranges::find(groups, group) != groups.end();
}

bool is_member(uid_t user, gid_t group) {
  std::vector<char> text(16384);
  passwd entry{};
  passwd* found = nullptr;
  if (::getpwuid_r(user, &entry, text.data(), text.size(), &found) != 0 || found == nullptr) return false;
  std::vector<gid_t> groups(256);
  int count = static_cast<int>(groups.size());
  if (::getgrouplist(found->pw_name, found->pw_gid, groups.data(), &count) < 0) return false;
  groups.resize(static_cast<std::size_t>(count));
  return std::ranges::find(groups, group) != groups.end();
}

constexpr mode_t kRead = 4;
constexpr mode_t kWrite = 2;

std::array<std::atomic<uid_t>, kMostInstanceUsers> instance_users{};

bool is_of_instances(uid_t user) noexcept {
  return user != 0 && std::ranges::any_of(instance_users, [user](const std::atomic<uid_t>& known) {
           return known.load(std::memory_order_relaxed) == user;
         });
}

}  // namespace

bool is_own_or_roots(uid_t owner) noexcept {
  return owner == 0 || owner == ::geteuid();
}

bool is_trusted_owner(uid_t owner) noexcept {
  return is_own_or_roots(owner) || is_of_instances(owner);
}

// 0 is an empty place: root needs none.
bool trust_instances_of(uid_t user) noexcept {
  if (user == 0 || is_of_instances(user)) return true;
  for (std::atomic<uid_t>& place : instance_users) {
    uid_t empty = 0;
    if (place.compare_exchange_strong(empty, user)) return true;
  }
  return false;
}

std::vector<uid_t> users_of_instances() {
  std::vector<uid_t> users;
  for (const std::atomic<uid_t>& place : instance_users) {
    if (const uid_t user = place.load(); user != 0) users.push_back(user);
  }
  return users;
}

bool is_any_owner(uid_t /*owner*/) noexcept {
  return true;
}

Permission permission_for_caller(uid_t owner, gid_t group, mode_t mode) {
  const uid_t caller = ::geteuid();
  if (caller == 0) return {.read = true, .write = true};
  mode_t bits = mode;
  if (caller == owner) {
    bits >>= 6U;
  } else if (caller_is_in(group)) {
    bits >>= 3U;
  }
  return {.read = (bits & kRead) != 0, .write = (bits & kWrite) != 0};
}

bool allows_to_write(const MemoryRights& rights, uid_t user) {
  if (user == 0 || user == rights.owner.value_or(::geteuid()) || (rights.mode & S_IWOTH) != 0) return true;
  return (rights.mode & S_IWGRP) != 0 && is_member(user, rights.group.value_or(::getegid()));
}

bool may_give_to(gid_t group) {
  return ::geteuid() == 0 || caller_is_in(group);
}

bool has_rights(const struct stat& status, const MemoryRights& rights) noexcept {
  constexpr mode_t kPermissions = 07777;
  return status.st_uid == rights.owner.value_or(status.st_uid) &&
         status.st_gid == rights.group.value_or(status.st_gid) &&
         (status.st_mode & kPermissions) == rights.mode;
}

std::string describe_rights(uid_t owner, gid_t group, mode_t mode) {
  return fmt::format("owner {}, group {}, mode {:04o}", owner, group, mode & 07777U);
}

Result<void> give_rights(int fd, const MemoryRights& rights, const std::string& path) {
  constexpr auto kSame = static_cast<uid_t>(-1);
  if ((rights.owner || rights.group) &&
      ::fchown(fd, rights.owner.value_or(kSame), rights.group.value_or(kSame)) != 0) {
    const int error = errno;
    return failure(error == EPERM ? ErrorCode::refused : ErrorCode::system,
                   fmt::format("cannot give {} to owner {} and group {}", path,
                               rights.owner.value_or(::geteuid()), rights.group.value_or(::getegid())),
                   error);
  }
  PLCHOST_TRY(check_errno(::fchmod(fd, rights.mode), "cannot set the rights of " + path));
  return {};
}

}  // namespace plchost
