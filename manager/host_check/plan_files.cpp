#include "manager/host_check/plan_files.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

constexpr mode_t kFolderMode = 0755;
constexpr mode_t kFileMode = 0644;
constexpr mode_t kAllBits = 07777;
// Behind the name: so neither systemd, udev, sysctl nor grub reads a file that is half there.
constexpr auto kFresh = ".plchost-new";

std::unexpected<Error> of_another(const std::string& shown, std::string_view what) {
  return failure(ErrorCode::refused, fmt::format("{} is {}; move it away", shown, what));
}

// Up to the most that any file of a plan has, and one byte: a longer one is no such file.
Result<std::string> read_some(int fd, const std::string& shown) {
  std::array<char, std::size_t{1} << 16> bytes{};
  std::string text;
  while (text.size() <= bytes.size()) {
    PLCHOST_TRY_ASSIGN(const auto length,
                       check_errno(::read(fd, bytes.data(), bytes.size()), "cannot read " + shown));
    if (length == 0) break;
    text.append(bytes.data(), static_cast<std::size_t>(length));
  }
  return text;
}

Result<void> write_fresh(int folder, const std::string& name, std::string_view text,
                         const std::string& shown) {
  const UniqueFd fd(
      ::openat(folder, name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kFileMode));
  if (!fd) return failure(ErrorCode::system, "cannot make " + shown, errno);
  while (!text.empty()) {
    PLCHOST_TRY_ASSIGN(const auto written,
                       check_errno(::write(fd.get(), text.data(), text.size()), "cannot write " + shown));
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  // Others' programs read it as their users, whatever the umask is.
  PLCHOST_TRY(check_errno(::fchmod(fd.get(), kFileMode), "cannot give rights to " + shown));
  PLCHOST_TRY(check_errno(::fsync(fd.get()), "cannot sync " + shown));
  return {};
}

Result<void> link_fresh(int folder, const std::string& name, const char* target, const std::string& shown) {
  PLCHOST_TRY(check_errno(::symlinkat(target, folder, name.c_str()), "cannot make " + shown));
  return {};
}

Result<std::string> target_of(int folder, const std::string& name, const std::string& shown) {
  std::array<char, 256> target{};
  PLCHOST_TRY_ASSIGN(const auto length,
                     check_errno(::readlinkat(folder, name.c_str(), target.data(), target.size()),
                                 "cannot read the link " + shown));
  return std::string(target.data(), static_cast<std::size_t>(length));
}

}  // namespace

Result<PlanFiles::Way> PlanFiles::way_to(PlanPart part, bool make) const {
  const std::string path = place_of(part).path;
  std::string shown = root_;
  UniqueFd above;
  std::string folder_name;
  UniqueFd folder(::open(root_.empty() ? "/" : root_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder) return failure(ErrorCode::system, "cannot open folder " + root_, errno);
  const std::size_t last = path.rfind('/');
  for (std::size_t at = 0; at < last;) {
    const std::size_t end = path.find('/', at + 1);
    const std::string name = path.substr(at + 1, end - at - 1);
    at = end;
    shown += "/" + name;
    constexpr int kFlags = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;
    UniqueFd next(::openat(folder.get(), name.c_str(), kFlags));
    if (!next && errno == ENOENT) {
      if (!make) return Way{.name = path.substr(last + 1), .shown = root_ + path};
      PLCHOST_TRY(
          check_errno(::mkdirat(folder.get(), name.c_str(), kFolderMode), "cannot make folder " + shown));
      PLCHOST_TRY(check_errno(::fsync(folder.get()), "cannot sync the folder of " + shown));
      next.reset(::openat(folder.get(), name.c_str(), kFlags));
    }
    if (!next && (errno == ENOTDIR || errno == ELOOP))
      return of_another(shown, "a file or a symbolic link, where a folder has to be");
    if (!next) return failure(ErrorCode::system, "cannot open folder " + shown, errno);
    above = std::move(folder);
    folder_name = name;
    folder = std::move(next);
  }
  return Way{.above = std::move(above),
             .folder_name = std::move(folder_name),
             .folder = std::move(folder),
             .name = path.substr(last + 1),
             .shown = root_ + path};
}

Result<PlanFiles::State> PlanFiles::look(const Way& way, const PlannedFile& file) const {
  struct stat found{};
  if (!way.folder) return State::missing;
  if (::fstatat(way.folder.get(), way.name.c_str(), &found, AT_SYMLINK_NOFOLLOW) != 0) {
    if (errno == ENOENT) return State::missing;
    return failure(ErrorCode::system, "cannot look at " + way.shown, errno);
  }
  if (const std::string_view wanted = place_of(file.part).link; !wanted.empty()) {
    if (!S_ISLNK(found.st_mode)) return of_another(way.shown, "no link of plchost");
    PLCHOST_TRY_ASSIGN(const auto target, target_of(way.folder.get(), way.name, way.shown));
    if (target == wanted) return State::same;
    // As 'systemctl reenable' has made it from a unit of an earlier plan.
    if (target == place_of(PlanPart::unit).path) return State::other;
    return of_another(way.shown, "a link to somewhere else");
  }
  if (!S_ISREG(found.st_mode)) return of_another(way.shown, "no plain file");
  const UniqueFd fd(
      ::openat(way.folder.get(), way.name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (!fd) return failure(ErrorCode::system, "cannot open " + way.shown, errno);
  PLCHOST_TRY_ASSIGN(const auto text, read_some(fd.get(), way.shown));
  if (!text.starts_with(kPlanMark)) return of_another(way.shown, "there, and plchost has not made it");
  // Another owner, or a second name elsewhere, could change what root's programs read.
  const bool owned = found.st_uid == 0 || (!root_.empty() && found.st_uid == ::geteuid());
  const bool safe = owned && found.st_nlink == 1 && (found.st_mode & kAllBits) == kFileMode;
  return text == file.text && safe ? State::same : State::other;
}

Result<PlanFiles::State> PlanFiles::state(const PlannedFile& file) const {
  PLCHOST_TRY_ASSIGN(const auto way, way_to(file.part, false));
  return look(way, file);
}

Result<void> PlanFiles::write(const PlannedFile& file) const {
  PLCHOST_TRY_ASSIGN(const auto way, way_to(file.part, true));
  const int folder = way.folder.get();
  const std::string fresh = way.name + kFresh;
  if (::unlinkat(folder, fresh.c_str(), 0) != 0 && errno != ENOENT)
    return failure(ErrorCode::system, fmt::format("cannot remove {}{}", way.shown, kFresh), errno);
  const char* const link = place_of(file.part).link;
  auto made = *link == '\0' ? write_fresh(folder, fresh, file.text, way.shown)
                            : link_fresh(folder, fresh, link, way.shown);
  if (made && ::renameat(folder, fresh.c_str(), folder, way.name.c_str()) != 0)
    made = failure(ErrorCode::system, "cannot put in place " + way.shown, errno);
  if (!made) {
    ::unlinkat(folder, fresh.c_str(), 0);
    return made;
  }
  PLCHOST_TRY(check_errno(::fsync(folder), "cannot sync the folder of " + way.shown));
  return {};
}

Result<bool> PlanFiles::remove(PlanPart part) const {
  PLCHOST_TRY_ASSIGN(const auto way, way_to(part, false));
  if (!way.folder) return false;
  const int folder = way.folder.get();
  bool removed = ::unlinkat(folder, (way.name + kFresh).c_str(), 0) == 0;
  PLCHOST_TRY_ASSIGN(const auto state, look(way, {part, {}}));
  if (state != State::missing) {
    PLCHOST_TRY(check_errno(::unlinkat(folder, way.name.c_str(), 0), "cannot remove " + way.shown));
    removed = true;
  }
  if (!removed) return false;
  PLCHOST_TRY(check_errno(::fsync(folder), "cannot sync the folder of " + way.shown));
  if (place_of(part).own_folder) {
    // Unless somebody else has a file in it.
    ::unlinkat(way.above.get(), way.folder_name.c_str(), AT_REMOVEDIR);
  }
  return true;
}

}  // namespace plchost
