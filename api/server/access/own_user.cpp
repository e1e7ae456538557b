#include "api/server/access/own_user.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "shm/base/system_call.hpp"
#include "shm/process/capabilities.hpp"
#include "shm/process/user_account.hpp"

namespace plchost {

namespace {

// Lower than what it is allowed now.
Result<void> limit(decltype(RLIMIT_NICE) what, rlim_t most) {
  rlimit now{};
  PLCHOST_TRY(check_errno(::getrlimit(what, &now), "cannot read a limit"));
  now.rlim_max = std::min(now.rlim_max, most);
  now.rlim_cur = std::min(now.rlim_cur, now.rlim_max);
  PLCHOST_TRY(check_errno(::setrlimit(what, &now), "cannot set a limit"));
  return {};
}

}  // namespace

FileView files_of_server(const ServerFolders& folders) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  FileView files;
  // Programs load libraries and modules, look up names and read what the kernel says of the host.
  files.read = {"/usr",
                "/lib",
                "/lib64",
                "/proc",
                "/sys",
                "/dev/random",
                "/dev/urandom",
                program.string(),
                (program.parent_path() / "lib").string(),
                folders.run,
                folders.applications};
  for (const char* name :
       {"gai.conf", "group", "host.conf", "hosts", "ld.so.cache", "localtime", "machine-id", "nsswitch.conf",
        "passwd", "protocols", "resolv.conf", "services", "ssl/openssl.cnf", "timezone"}) {
    files.read.push_back(fmt::format("/etc/{}", name));
  }
  // Of another file of the configuration, whose folder may be put in place of this one.
  if (!folders.identity.empty()) {
    files.read.push_back(std::filesystem::path(folders.identity).parent_path().string());
  }
  files.write = {"/dev/null", "/dev/shm", folders.audit};
  return files;
}

Result<std::string> become_user(const OwnUser& wanted) {
  PLCHOST_TRY_ASSIGN(const auto user, find_user(wanted.user));
  PLCHOST_TRY(check_errno(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0), "cannot set no_new_privs"));
  constexpr mode_t kNotForOthers = 0027;  // the manager reads by its group
  ::umask(kNotForOthers);
  PLCHOST_TRY(limit(RLIMIT_RTPRIO, static_cast<rlim_t>(wanted.most_fifo)));
  PLCHOST_TRY(limit(RLIMIT_NICE, 0));
  PLCHOST_TRY(take_user(user));
  PLCHOST_TRY(give_up_all_capabilities());
  const auto restricted = restrict_files(wanted.files);
  if (restricted) return std::string();
  if (restricted.error().code == ErrorCode::unavailable) return restricted.error().describe();
  return std::unexpected(restricted.error());
}

}  // namespace plchost
