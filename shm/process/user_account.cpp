#include "shm/process/user_account.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

std::optional<uid_t> number_of_user(std::string_view text) {
  uid_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

std::vector<gid_t> groups_of_thread() {
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(::getgroups(0, nullptr), 0)));
  const int count = ::getgroups(static_cast<int>(groups.size()), groups.data());
  groups.resize(static_cast<std::size_t>(std::max(count, 0)));
  return groups;
}

}  // namespace

Result<UserAccount> find_user(const std::string& text) {
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
  const uid_t user = found == nullptr ? *number : account.pw_uid;
  if (user == 0) return failure(ErrorCode::invalid_argument, "root is no user with fewer rights");
  if (found == nullptr) return UserAccount{.number = user, .group = user, .groups = {user}};
  std::vector<gid_t> groups(256);
  int count = static_cast<int>(groups.size());
  (void)::getgrouplist(account.pw_name, account.pw_gid, groups.data(), &count);
  groups.resize(static_cast<std::size_t>(std::clamp(count, 0, static_cast<int>(groups.size()))));
  return UserAccount{.number = user, .group = account.pw_gid, .groups = std::move(groups)};
}

Result<void> take_user(const UserAccount& user) {
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

// The system calls and not the functions: those would change all threads.
FilesAsUser::FilesAsUser(uid_t user, gid_t group) noexcept
    : groups_(groups_of_thread()), before_(::geteuid()), dumpable_(::prctl(PR_GET_DUMPABLE, 0, 0, 0, 0)) {
  std::vector<gid_t> more = groups_;
  more.push_back(group);
  const bool in_group = ::syscall(SYS_setgroups, more.size(), more.data()) == 0;
  constexpr auto kNobody = static_cast<uid_t>(-1);  // changes nothing, and tells the user of now
  (void)::syscall(SYS_setfsuid, user);
  can_ = in_group && static_cast<uid_t>(::syscall(SYS_setfsuid, kNobody)) == user;
}

FilesAsUser::~FilesAsUser() {
  (void)::syscall(SYS_setfsuid, before_);
  (void)::syscall(SYS_setgroups, groups_.size(), groups_.data());
  if (dumpable_ == 1) (void)::prctl(PR_SET_DUMPABLE, 1, 0, 0, 0);  // each change of the user clears it
}

}  // namespace plchost
