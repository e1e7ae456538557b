#include "shm/process/file_view.hpp"

#include <cerrno>
#include <cstdint>

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

constexpr std::uint64_t kReadFile = LANDLOCK_ACCESS_FS_READ_FILE;
constexpr std::uint64_t kRead = kReadFile | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kTruncate = std::uint64_t{1} << 14U;  // newer than Debian 12's headers
constexpr std::uint64_t kWriteFile = kReadFile | LANDLOCK_ACCESS_FS_WRITE_FILE;
constexpr std::uint64_t kWrite = kRead | kWriteFile | LANDLOCK_ACCESS_FS_MAKE_REG |
                                 LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE |
                                 LANDLOCK_ACCESS_FS_REMOVE_DIR;
// Of its first version.
constexpr std::uint64_t kAll = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1U) - 1;
constexpr long kVersionOfTruncate = 3;

Result<void> allow(int rules, const std::string& path, std::uint64_t in_folder, std::uint64_t of_file) {
  const UniqueFd fd(::open(path.c_str(), O_PATH | O_CLOEXEC));
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0) return {};
  const landlock_path_beneath_attr rule{.allowed_access = S_ISDIR(status.st_mode) ? in_folder : of_file,
                                        .parent_fd = fd.get()};
  PLCHOST_TRY(check_errno(::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &rule, 0),
                          "cannot allow the use of " + path));
  return {};
}

}  // namespace

Result<void> restrict_files(const FileView& view) {
  const long version = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 0) {
    return failure(ErrorCode::unavailable, "this kernel has no Landlock, or it is switched off", errno);
  }
  const std::uint64_t truncate = version >= kVersionOfTruncate ? kTruncate : 0;
  landlock_ruleset_attr handled{};  // newer kernels' headers have more members
  handled.handled_access_fs = kAll | truncate;
  PLCHOST_TRY_ASSIGN(const long made,
                     check_errno(::syscall(SYS_landlock_create_ruleset, &handled, sizeof handled, 0),
                                 "cannot use Landlock"));
  const UniqueFd rules(static_cast<int>(made));
  for (const std::string& path : view.read) PLCHOST_TRY(allow(rules.get(), path, kRead, kReadFile));
  for (const std::string& path : view.write)
    PLCHOST_TRY(allow(rules.get(), path, kWrite | truncate, kWriteFile | truncate));
  PLCHOST_TRY(check_errno(::syscall(SYS_landlock_restrict_self, rules.get(), 0), "cannot use Landlock"));
  return {};
}

}  // namespace plchost
