#include "shm/files/memory_file.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMaxFileName = 255;  // NAME_MAX

Result<std::string> path_of(const std::string& name) {
  if (name.size() > kMaxFileName) {
    return failure(
        ErrorCode::invalid_argument,
        fmt::format("shared memory '{}' would have a file name of {} bytes, {} are allowed. Choose a "
                    "shorter name, or one with fewer characters other than letters, digits, '_', "
                    "'-' or '.': each takes three bytes",
                    shown(name), name.size(), kMaxFileName));
  }
  std::string plain = name;  // as pool_memory_name() of shm/files/pool_files.hpp writes it
  std::ranges::replace_if(
      plain, [](char c) { return c == '%' || static_cast<unsigned char>(c) >= 0x80; }, '_');
  PLCHOST_TRY(check_name("shared memory name", plain, kMaxFileName));
  return MemoryFile::path(name);
}

Result<GuardedMapping> map(const UniqueFd& fd, std::size_t size, MemoryFile::Access access,
                           const std::string& path) {
  const int protection = access == MemoryFile::Access::read_write ? PROT_READ | PROT_WRITE : PROT_READ;
  void* const address = ::mmap(nullptr, size, protection, MAP_SHARED, fd.get(), 0);
  if (address == MAP_FAILED) {
    const int error = errno;
    return failure(ErrorCode::system, fmt::format("cannot map {} bytes of {}", size, path), error);
  }
  return GuardedMapping(std::span(static_cast<std::byte*>(address), size));
}

Result<void> allocate(const UniqueFd& fd, std::size_t size, const std::string& path) {
  int error = 0;
  do {
    error = ::posix_fallocate(fd.get(), 0, static_cast<off_t>(size));
  } while (error == EINTR);
  if (error == ENOSPC || error == ENOMEM || error == EFBIG) {
    return failure(
        ErrorCode::full,
        fmt::format("{} bytes of shared memory for {}: {} has no room; free some there, enlarge it or "
                    "ask for less",
                    size, path, MemoryFile::kDirectory),
        error);
  }
  return check_returned(error, fmt::format("cannot allocate {} bytes for {}", size, path));
}

Result<UniqueFd> make_nameless(std::size_t size, const MemoryRights& rights, const std::string& path) {
  if (size == 0) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("shared memory {} must have at least 1 byte", path));
  }
  // Without a name until it is complete: there is no half-made one for others to find or to clean up after.
  UniqueFd fd(::open(MemoryFile::kDirectory, O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR));
  if (!fd) {
    const int error = errno;
    return failure(ErrorCode::system,
                   fmt::format("cannot create shared memory in {}", MemoryFile::kDirectory), error);
  }
  PLCHOST_TRY(give_rights(fd.get(), rights, path));
  PLCHOST_TRY(allocate(fd, size, path));
  return fd;
}

Result<void> link_to(const UniqueFd& fd, const std::string& path) {
  const std::string self = fmt::format("/proc/self/fd/{}", fd.get());
  if (::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW) == 0) return {};
  const int error = errno;
  if (error == EEXIST) return failure(ErrorCode::already_exists, fmt::format("{} exists already", path));
  return failure(ErrorCode::system, fmt::format("cannot give shared memory the name {}", path), error);
}

ErrorCode code_of_open(int error) noexcept {
  if (error == ENOENT) return ErrorCode::not_found;
  return error == EACCES ? ErrorCode::refused : ErrorCode::system;
}

std::string_view kind_of(mode_t mode) noexcept {
  if (S_ISDIR(mode)) return "folder";
  if (S_ISFIFO(mode)) return "FIFO";
  if (S_ISLNK(mode)) return "symbolic link";
  if (S_ISSOCK(mode)) return "socket";
  return "device";
}

std::unexpected<Error> not_a_plain_file(const std::string& path, mode_t mode) {
  return failure(ErrorCode::wrong_type,
                 fmt::format("{} is a {} where shared memory, a plain file, is expected; "
                             "remove it, or choose another name",
                             path, kind_of(mode)));
}

/// An existing file, and what it is.
struct Opened {
  UniqueFd fd;
  struct stat status{};
};

Result<Opened> open_existing(const std::string& path, MemoryFile::Access access, const OwnerCheck& owners) {
  // O_NONBLOCK: were it a FIFO, a plain open would wait for ever.
  const int flags =
      (access == MemoryFile::Access::read_write ? O_RDWR : O_RDONLY) | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  Opened opened{.fd = UniqueFd(::open(path.c_str(), flags))};
  if (!opened.fd) {
    const int error = errno;
    // These cannot be opened so: a folder to write, a link at all, a socket.
    if (::lstat(path.c_str(), &opened.status) == 0 && !S_ISREG(opened.status.st_mode)) {
      return not_a_plain_file(path, opened.status.st_mode);
    }
    return failure(code_of_open(error), fmt::format("cannot open {}", path), error);
  }
  PLCHOST_TRY(check_errno(::fstat(opened.fd.get(), &opened.status), "cannot examine " + path));
  if (!S_ISREG(opened.status.st_mode)) {
    return not_a_plain_file(path, opened.status.st_mode);
  }
  // Of more than one name: it may have been made under another one, for something else.
  if (owners(opened.status.st_uid) && opened.status.st_nlink <= 1) return opened;
  return failure(
      ErrorCode::refused,
      fmt::format("{} is not used: it has {} and {} names, and was put there by another program; "
                  "remove it, or choose another name",
                  path, describe_rights(opened.status.st_uid, opened.status.st_gid, opened.status.st_mode),
                  opened.status.st_nlink));
}

}  // namespace

Result<UnnamedMemory> UnnamedMemory::make(const std::string& name, std::size_t size,
                                          const MemoryRights& rights) {
  PLCHOST_TRY_ASSIGN(auto path, path_of(name));
  PLCHOST_TRY_ASSIGN(auto fd, make_nameless(size, rights, path));
  struct stat status{};
  PLCHOST_TRY(check_errno(::fstat(fd.get(), &status), "cannot examine " + path));
  PLCHOST_TRY_ASSIGN(auto mapping, map(fd, size, MemoryFile::Access::read_write, path));
  return UnnamedMemory(std::move(path), std::move(fd), MemoryFile(std::move(mapping), status.st_ino));
}

namespace {

// A folder. Its contents are not looked at: they may be a stranger's trap.
bool put_folder_away(const std::string& path) noexcept {
  if (::rmdir(path.c_str()) == 0 || errno == ENOENT) return true;
  if (errno != ENOTEMPTY && errno != EEXIST) return false;
  struct stat status{};
  if (::lstat(path.c_str(), &status) != 0) return errno == ENOENT;
  const std::string aside = fmt::format("{}/.put-aside.{}", MemoryFile::kDirectory, status.st_ino);
  return ::renameat2(AT_FDCWD, path.c_str(), AT_FDCWD, aside.c_str(), RENAME_NOREPLACE) == 0;
}

}  // namespace

// In a sticky folder only its owner, the folder's or root may remove a file.
Result<void> take_away(const std::string& path) {
  if (::unlink(path.c_str()) == 0 || errno == ENOENT) return {};
  if (errno == EISDIR && put_folder_away(path)) return {};
  const int error = errno;
  struct stat status{};
  const bool seen = ::lstat(path.c_str(), &status) == 0;
  return failure(
      error == EPERM || error == EACCES ? ErrorCode::refused : ErrorCode::system,
      fmt::format(
          "{} is in the way, a file {}of another user ({} is sticky): only that user or root "
          "can remove it; do that, or choose another name",
          path,
          seen ? fmt::format("({}) ", describe_rights(status.st_uid, status.st_gid, status.st_mode)) : "",
          MemoryFile::kDirectory),
      error);
}

Result<void> UnnamedMemory::give_name(const TakeOver& take_over) {
  constexpr int kAttempts = 10;  // each one fails only if another process makes the name anew in between
  for (int attempt = 1;; ++attempt) {
    auto named = link_to(fd_, path_);
    if (named) return named;
    if (named.error().code != ErrorCode::already_exists || attempt == kAttempts || !take_over(path_)) {
      return named;
    }
    replaced_.reset(::open(path_.c_str(), O_PATH | O_NOFOLLOW | O_CLOEXEC));
    if (auto gone = take_away(path_); !gone) return gone;
  }
}

namespace {

Result<MemoryFile> make_filled(const std::string& name, std::size_t size, const MemoryFile::Fill& fill,
                               const MemoryRights& rights, const UnnamedMemory::TakeOver& take_over) {
  PLCHOST_TRY_ASSIGN(auto memory, UnnamedMemory::make(name, size, rights));
  if (fill) {
    PLCHOST_TRY(fill(memory.bytes()));
  }
  PLCHOST_TRY(memory.give_name(take_over));
  return memory.take();
}

}  // namespace

Result<MemoryFile> MemoryFile::create(const std::string& name, std::size_t size, const Fill& fill,
                                      const MemoryRights& rights) {
  return make_filled(name, size, fill, rights, [](const std::string&) { return false; });
}

Result<MemoryFile> MemoryFile::replace(const std::string& name, std::size_t size, const Fill& fill,
                                       const MemoryRights& rights) {
  return make_filled(name, size, fill, rights, [](const std::string&) { return true; });
}

Result<MemoryFile> MemoryFile::open(const std::string& name, std::size_t at_least, Access access,
                                    const OwnerCheck& owners) {
  PLCHOST_TRY_ASSIGN(const auto path, path_of(name));
  PLCHOST_TRY_ASSIGN(const auto opened, open_existing(path, access, owners));
  const auto size = static_cast<std::size_t>(opened.status.st_size);
  if (size == 0 || size < at_least) {
    return failure(ErrorCode::corrupt,
                   fmt::format("{} has {} bytes, at least {} are needed", path, size, at_least));
  }
  PLCHOST_TRY_ASSIGN(auto mapping, map(opened.fd, size, access, path));
  return MemoryFile(std::move(mapping), opened.status.st_ino);
}

Result<void> MemoryFile::fill_empty(const std::string& name, std::size_t size, const OwnerCheck& owners) {
  PLCHOST_TRY_ASSIGN(const auto path, path_of(name));
  PLCHOST_TRY_ASSIGN(const auto opened, open_existing(path, Access::read_write, owners));
  if (opened.status.st_size != 0) return {};
  return allocate(opened.fd, size, path);
}

bool MemoryFile::remove(const std::string& name) noexcept {
  const auto path = path_of(name);
  return !path || ::unlink(path->c_str()) == 0 || errno == ENOENT;
}

std::string MemoryFile::path(std::string_view name) {
  return fmt::format("{}/{}", kDirectory, name);
}

}  // namespace plchost
