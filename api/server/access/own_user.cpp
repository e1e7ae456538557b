#include "api/server/access/own_user.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/process/capabilities.hpp"

namespace plchost {

namespace {

struct User {
  uid_t number = 0;
  std::vector<gid_t> groups;
};

std::optional<uid_t> number_of_user(std::string_view text) {
  uid_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

// A number that no account has is a user without other groups.
Result<User> find_user(const std::string& text) {
  constexpr std::size_t kRoom = std::size_t{64} << 10;
  std::vector<char> texts(kRoom);
  passwd account{};
  passwd* found = nullptr;
  const auto number = number_of_user(text);
  if (number) {
    (void)::getpwuid_r(*number, &account, texts.data(), texts.size(), &found);
  } else {
    (void)::getpwnam_r(text.c_str(), &account, texts.data(), texts.size(), &found);
  }
  if (found == nullptr && !number) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("there is no user '{}' on this host", shown(text)));
  }
  User user{.number = found == nullptr ? *number : account.pw_uid, .groups = {}};
  if (user.number == 0) return failure(ErrorCode::invalid_argument, "root is no user with fewer rights");
  if (found == nullptr) return user;
  user.groups.resize(256);
  int count = static_cast<int>(user.groups.size());
  (void)::getgrouplist(account.pw_name, account.pw_gid, user.groups.data(), &count);
  user.groups.resize(static_cast<std::size_t>(std::clamp(count, 0, static_cast<int>(user.groups.size()))));
  return user;
}

// Lower than what it is allowed now.
Result<void> limit(decltype(RLIMIT_NICE) what, rlim_t most) {
  rlimit now{};
  PLCHOST_TRY(check_errno(::getrlimit(what, &now), "cannot read a limit"));
  now.rlim_max = std::min(now.rlim_max, most);
  now.rlim_cur = std::min(now.rlim_cur, now.rlim_max);
  PLCHOST_TRY(check_errno(::setrlimit(what, &now), "cannot set a limit"));
  return {};
}

Result<void> take_user(const User& user) {
  const gid_t group = ::getegid();
  const auto changed = [&](int returned) -> Result<void> {
    if (returned == 0) return {};
    const int error = errno;
    return failure(
        error == EPERM ? ErrorCode::refused : ErrorCode::system,
        fmt::format("cannot become user {}: that takes root with CAP_SETUID and CAP_SETGID", user.number),
        error);
  };
  PLCHOST_TRY(changed(::setgroups(user.groups.size(), user.groups.data())));
  PLCHOST_TRY(changed(::setresgid(group, group, group)));
  return changed(::setresuid(user.number, user.number, user.number));
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
