#include "shm/files/access_list.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <linux/posix_acl.h>
#include <linux/posix_acl_xattr.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

constexpr const char* kAccess = "system.posix_acl_access";
constexpr mode_t kBits = 07777;
constexpr mode_t kAll = 7;
constexpr auto kNoUser = static_cast<std::uint32_t>(ACL_UNDEFINED_ID);

using List = std::vector<std::byte>;

struct Entry {
  std::uint16_t tag;
  std::uint16_t rights;
  std::uint32_t user;
};
static_assert(sizeof(Entry) == sizeof(posix_acl_xattr_entry) && std::endian::native == std::endian::little);

// In the order that the kernel wants.
List list_of(std::vector<uid_t> users, mode_t rights, mode_t mode) {
  std::ranges::sort(users);
  users.erase(std::ranges::unique(users).begin(), users.end());
  const auto entry = [](std::uint16_t tag, mode_t allowed, std::uint32_t user = kNoUser) {
    return Entry{.tag = tag, .rights = static_cast<std::uint16_t>(allowed & kAll), .user = user};
  };
  std::vector<Entry> entries{entry(ACL_USER_OBJ, mode >> 6U)};
  for (const uid_t user : users) entries.push_back(entry(ACL_USER, rights, user));
  entries.push_back(entry(ACL_GROUP_OBJ, mode >> 3U));
  entries.push_back(entry(ACL_MASK, (mode >> 3U) | rights));
  entries.push_back(entry(ACL_OTHER, mode));
  const std::uint32_t version = POSIX_ACL_XATTR_VERSION;
  List list(sizeof version + entries.size() * sizeof(Entry));
  std::memcpy(list.data(), &version, sizeof version);
  std::memcpy(list.data() + sizeof version, entries.data(), entries.size() * sizeof(Entry));
  return list;
}

// Empty: it has none.
List list_now(int fd) {
  List list(1024);
  const ssize_t size = ::fgetxattr(fd, kAccess, list.data(), list.size());
  list.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return list;
}

mode_t bits_now(int fd) {
  struct stat status{};
  return ::fstat(fd, &status) == 0 ? status.st_mode & kBits : 0;
}

bool has_bits(int fd, mode_t mode, mode_t which = kBits) {
  return ((bits_now(fd) ^ mode) & which) == 0;
}

bool is_ours(int fd) {
  struct stat status{};
  return ::fstat(fd, &status) == 0 && (::geteuid() == 0 || status.st_uid == ::geteuid());
}

Result<void> set_bits(int fd, mode_t mode, const std::string& path) {
  if (::fchmod(fd, mode) == 0) return {};
  const int error = errno;
  return failure(error == EPERM ? ErrorCode::refused : ErrorCode::system, "cannot set the rights of " + path,
                 error);
}

Result<void> take_list_away(int fd, const std::string& path) {
  if (::fremovexattr(fd, kAccess) == 0 || errno == ENODATA || errno == EOPNOTSUPP) return {};
  return failure(ErrorCode::system, "cannot take the access list from " + path, errno);
}

}  // namespace

Result<void> let_users(int fd, std::span<const uid_t> users, mode_t rights, mode_t mode,
                       const std::string& path) {
  const List wanted = users.empty() ? List() : list_of(std::vector(users.begin(), users.end()), rights, mode);
  const mode_t shown = users.empty() ? mode : mode | (rights & kAll) << 3U;
  if (list_now(fd) == wanted && has_bits(fd, shown)) return {};
  if (users.empty()) {
    PLCHOST_TRY(take_list_away(fd, path));
    return set_bits(fd, mode, path);
  }
  // The list brings all bits but this one. None is taken away before: instances may be using them.
  if (!has_bits(fd, mode, S_ISVTX)) PLCHOST_TRY(set_bits(fd, bits_now(fd) ^ S_ISVTX, path));
  if (::fsetxattr(fd, kAccess, wanted.data(), wanted.size(), 0) == 0) return {};
  const int error = errno;
  return failure(error == EPERM && !is_ours(fd) ? ErrorCode::refused : ErrorCode::unsupported,
                 "cannot give users rights to " + path, error);
}

}  // namespace plchost
