#include "manager/system/hand_over.hpp"

#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr mode_t kKeptBits = 0777;
constexpr std::size_t kLargestLeft = std::size_t{32} << 20;  // retain variables have up to 16 MiB

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

Result<void> write_as(const UserAccount& user, const std::string& path, std::string_view text) {
  const FilesAsUser rights(user.number, user.group);
  if (!rights.can()) return no_rights_of(user.number);
  return write_whole_file(path, text, S_IRUSR | S_IWUSR);
}

// Only its owner may, and only to a group that he is in.
Result<void> give_group(const UserAccount& user, const std::string& path, const struct stat& before) {
  constexpr auto kSame = static_cast<uid_t>(-1);
  const FilesAsUser rights(user.number, before.st_gid);
  if (!rights.can()) return no_rights_of(user.number);
  PLCHOST_TRY(
      check_errno(::lchown(path.c_str(), kSame, before.st_gid), "cannot give " + path + " to its group"));
  PLCHOST_TRY(check_errno(::chmod(path.c_str(), before.st_mode & kKeptBits),
                          "cannot set the permission bits of " + path));
  return {};
}

}  // namespace

std::optional<struct stat> plain_file(const std::string& path) {
  struct stat status{};
  const bool plain = ::lstat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && status.st_nlink == 1;
  return plain ? std::optional(status) : std::nullopt;
}

std::unexpected<Error> no_rights_of(uid_t user) {
  return failure(ErrorCode::refused, fmt::format("cannot open files as user {}", user));
}

// The old one is there until the new one is whole.
Result<void> hand_over(const std::string& path, const UserAccount& user) {
  const auto before = plain_file(path);
  if (!before || before->st_uid == user.number) return {};
  PLCHOST_TRY_ASSIGN(const auto text, read_as_owner(path, *before));
  const std::string fresh = path + ".new";
  PLCHOST_TRY(take_away(fresh));
  auto written = write_as(user, fresh, text);
  if (written) written = give_group(user, fresh, *before);
  if (written && ::rename(fresh.c_str(), path.c_str()) != 0)
    written = failure(ErrorCode::system, "cannot rename " + fresh, errno);
  if (!written) ::unlink(fresh.c_str());
  return written;
}

Result<void> hand_over_believed(const std::string& path, const UserAccount& user,
                                const OwnerCheck& believed) {
  struct stat status{};
  if (::lstat(path.c_str(), &status) != 0) return {};
  if (plain_file(path) && believed(status.st_uid)) return hand_over(path, user);
  PLCHOST_TRY(take_away(path));
  spdlog::warn("{} was put there by another user ({}); it is removed and not used", path,
               describe_rights(status.st_uid, status.st_gid, status.st_mode));
  return {};
}

}  // namespace plchost
