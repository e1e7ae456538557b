// Loaded with LD_PRELOAD, or linked: records each change to a file below the folder $RECORDED_FOLDER, with
// all syncs, in the file $RECORDING. It stands where a program calls the C library. So the recording has the
// calls of all processes that have loaded it, in their order. $DISK_FAULT is a file. While it says "full",
// "read-only" or "slow MS", the disk is so.
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include "tests/integration/storage/recording.hpp"

#define EXPORTED extern "C" __attribute__((visibility("default")))  // NOLINT(cppcoreguidelines-macro-usage)

namespace {

using plchost::ChangeHead;
using plchost::ChangeKind;

using Path = std::array<char, PATH_MAX>;

// NOLINTBEGIN(concurrency-mt-unsafe): the environment is changed while there is one thread
const char* recording() {
  return std::getenv("RECORDING");
}
const char* folder() {
  return std::getenv("RECORDED_FOLDER");
}
const char* fault_file() {
  return std::getenv("DISK_FAULT");
}
// NOLINTEND(concurrency-mt-unsafe)

bool is_below_folder(const char* path) {
  const char* const top = folder();
  if (top == nullptr) return false;
  const std::size_t length = std::strlen(top);
  return std::strncmp(path, top, length) == 0 && (path[length] == '/' || path[length] == '\0');
}

/// False: it is no name of a file.
bool path_of(int fd, Path& path) {
  std::array<char, 32> link{};
  (void)std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", fd);
  const auto length = ::syscall(SYS_readlinkat, AT_FDCWD, link.data(), path.data(), path.size() - 1);
  if (length <= 0) return false;
  path[static_cast<std::size_t>(length)] = '\0';
  return path[0] == '/';
}

/// The path in full, if it is below the folder.
bool is_ours(int folder_fd, const char* path, Path& full) {
  if (folder() == nullptr || path == nullptr) return false;
  if (path[0] == '/') {
    (void)std::snprintf(full.data(), full.size(), "%s", path);
  } else {
    Path base{};
    const bool known =
        folder_fd == AT_FDCWD ? ::getcwd(base.data(), base.size()) != nullptr : path_of(folder_fd, base);
    if (!known) return false;
    (void)std::snprintf(full.data(), full.size(), "%.*s/%s", PATH_MAX / 2, base.data(), path);
  }
  return is_below_folder(full.data());
}

bool is_ours(int fd, Path& full) {
  return folder() != nullptr && path_of(fd, full) && is_below_folder(full.data());
}

std::uint64_t inode_of(int fd) {
  struct stat status{};
  return ::fstat(fd, &status) == 0 ? status.st_ino : 0;
}

std::uint64_t inode_of(const char* path) {
  struct stat status{};
  return ::lstat(path, &status) == 0 ? status.st_ino : 0;
}

/// One system call for each, so that those of several processes do not mix.
void record(ChangeKind kind, std::uint64_t inode, std::uint64_t number, std::string_view path,
            std::string_view other = {}) {
  if (recording() == nullptr) return;
  const int error = errno;
  const auto fd = static_cast<int>(::syscall(SYS_openat, AT_FDCWD, recording(),
                                             O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (fd >= 0) {
    ChangeHead head{.kind = kind,
                    .process = static_cast<std::uint32_t>(::getpid()),
                    .inode = inode,
                    .number = number,
                    .path_bytes = static_cast<std::uint32_t>(path.size()),
                    .other_bytes = static_cast<std::uint32_t>(other.size())};
    const std::array parts{iovec{.iov_base = &head, .iov_len = sizeof head},
                           iovec{.iov_base = const_cast<char*>(path.data()), .iov_len = path.size()},
                           iovec{.iov_base = const_cast<char*>(other.data()), .iov_len = other.size()}};
    (void)::syscall(SYS_writev, fd, parts.data(), parts.size());
    (void)::syscall(SYS_close, fd);
  }
  errno = error;
}

enum class Needs { room, change };

/// The error with which the disk refuses it, or 0. Waits as long as the disk does.
int fault_of_disk(Needs needs, bool writes) {
  if (fault_file() == nullptr) return 0;
  const auto fd = static_cast<int>(::syscall(SYS_openat, AT_FDCWD, fault_file(), O_RDONLY | O_CLOEXEC));
  if (fd < 0) return 0;
  std::array<char, 32> text{};
  (void)::syscall(SYS_read, fd, text.data(), text.size() - 1);
  (void)::syscall(SYS_close, fd);
  const std::string_view said(text.data());
  if (said.starts_with("read-only")) return EROFS;
  if (said.starts_with("full")) return needs == Needs::room ? ENOSPC : 0;
  constexpr std::string_view kSlow = "slow ";
  if (said.starts_with(kSlow) && writes)
    ::usleep(static_cast<useconds_t>(std::atoi(text.data() + kSlow.size())) * 1000U);  // NOLINT(cert-err34-c)
  return 0;
}

int refused(int error) {
  errno = error;
  return -1;
}

int open_at(int folder_fd, const char* path, int flags, mode_t mode) {
  const auto open = [&](int with) {
    return static_cast<int>(::syscall(SYS_openat, folder_fd, path, with, mode));
  };
  Path full{};
  const bool changes = (flags & O_ACCMODE) != O_RDONLY || (flags & (O_CREAT | O_TRUNC)) != 0;
  if (!changes || !is_ours(folder_fd, path, full)) return open(flags);
  const bool makes = (flags & O_CREAT) != 0;
  if (const int error = fault_of_disk(makes ? Needs::room : Needs::change, false); error != 0)
    return refused(error);
  if (makes) {
    const int made = open(flags | O_EXCL);
    if (made >= 0) record(ChangeKind::create, inode_of(made), 0, full.data());
    if (made >= 0 || errno != EEXIST || (flags & O_EXCL) != 0) return made;
  }
  const int fd = open(flags & ~O_CREAT);
  if (fd >= 0 && (flags & O_TRUNC) != 0) record(ChangeKind::resize, inode_of(fd), 0, full.data());
  return fd;
}

/// `at`: its place, or less than 0 for where the descriptor is.
ssize_t write_at(int fd, const void* bytes, std::size_t size, off_t at) {
  const auto write = [&] {
    return at < 0 ? ::syscall(SYS_write, fd, bytes, size) : ::syscall(SYS_pwrite64, fd, bytes, size, at);
  };
  Path full{};
  if (!is_ours(fd, full)) return write();
  if (const int error = fault_of_disk(Needs::room, true); error != 0) return refused(error);
  const auto written = write();
  if (written <= 0) return written;
  const off_t end = at < 0 ? ::lseek(fd, 0, SEEK_CUR) : at + written;
  record(ChangeKind::write, inode_of(fd), static_cast<std::uint64_t>(end - written), full.data(),
         {static_cast<const char*>(bytes), static_cast<std::size_t>(written)});
  return written;
}

int sync(int fd, long call) {
  static std::atomic<std::uint32_t> last{0};
  Path full{};
  if (!is_ours(fd, full)) return static_cast<int>(::syscall(call, fd));
  // A file system that has become read-only syncs nothing; a full one does.
  if (const int error = fault_of_disk(Needs::change, false); error != 0) return refused(error);
  const std::uint64_t number = static_cast<std::uint64_t>(::getpid()) << 32U | ++last;
  const std::uint64_t inode = inode_of(fd);
  record(ChangeKind::sync_begin, inode, number, full.data());
  const auto result = static_cast<int>(::syscall(call, fd));
  if (result == 0) record(ChangeKind::sync_end, inode, number, full.data());
  return result;
}

int resize(int fd, off_t size) {
  Path full{};
  const bool ours = is_ours(fd, full);
  if (const int error = ours ? fault_of_disk(Needs::change, false) : 0; error != 0) return refused(error);
  const auto result = static_cast<int>(::syscall(SYS_ftruncate, fd, size));
  if (ours && result == 0)
    record(ChangeKind::resize, inode_of(fd), static_cast<std::uint64_t>(size), full.data());
  return result;
}

/// A change of one name.
template <class Call>
int change_name(ChangeKind kind, int folder_fd, const char* path, const Call& call) {
  Path full{};
  const bool ours = is_ours(folder_fd, path, full);
  const Needs needs = kind == ChangeKind::make_folder ? Needs::room : Needs::change;
  if (const int error = ours ? fault_of_disk(needs, false) : 0; error != 0) return refused(error);
  const auto result = static_cast<int>(call());
  if (ours && result == 0) {
    const bool made = kind == ChangeKind::make_folder;
    record(kind, made ? inode_of(full.data()) : 0, 0, full.data());
  }
  return result;
}

/// A change of two. One that goes over the border of the folder is not recorded.
template <class Call>
int change_names(ChangeKind kind, int from_fd, const char* from, int to_fd, const char* to,
                 const Call& call) {
  Path old{};
  Path fresh{};
  const bool ours_from = is_ours(from_fd, from, old);
  const bool ours_to = is_ours(to_fd, to, fresh);
  if (const int error = ours_from || ours_to ? fault_of_disk(Needs::change, false) : 0; error != 0)
    return refused(error);
  const auto result = static_cast<int>(call());
  if (result == 0 && ours_from && ours_to) record(kind, 0, 0, old.data(), fresh.data());
  if (result == 0 && ours_from != ours_to)
    record(ChangeKind::unknown, 0, 0, ours_from ? old.data() : fresh.data());
  return result;
}

mode_t mode_in(int flags, std::va_list rest) {
  return (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
}

/// fopen() opens within the C library: the file is made, or emptied, before. False: the disk refuses it.
bool prepare(const char* path, const char* mode) {
  Path full{};
  if (mode[0] == 'r' || !is_ours(AT_FDCWD, path, full)) return true;
  const int emptied = mode[0] == 'w' ? O_TRUNC : 0;
  const int fd = open_at(AT_FDCWD, path, O_WRONLY | O_CREAT | O_CLOEXEC | emptied, 0666);
  if (fd >= 0) (void)::syscall(SYS_close, fd);
  return fd >= 0;
}

}  // namespace

// NOLINTBEGIN(cert-dcl50-cpp): the C library's own forms
EXPORTED int open(const char* path, int flags, ...) {
  std::va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_in(flags, rest);
  va_end(rest);
  return open_at(AT_FDCWD, path, flags, mode);
}
EXPORTED int open64(const char* path, int flags, ...) {
  std::va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_in(flags, rest);
  va_end(rest);
  return open_at(AT_FDCWD, path, flags, mode);
}
EXPORTED int openat(int folder_fd, const char* path, int flags, ...) {
  std::va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_in(flags, rest);
  va_end(rest);
  return open_at(folder_fd, path, flags, mode);
}
EXPORTED int openat64(int folder_fd, const char* path, int flags, ...) {
  std::va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_in(flags, rest);
  va_end(rest);
  return open_at(folder_fd, path, flags, mode);
}
// NOLINTEND(cert-dcl50-cpp)
EXPORTED int creat(const char* path, mode_t mode) {
  return open_at(AT_FDCWD, path, O_WRONLY | O_CREAT | O_TRUNC, mode);
}
EXPORTED int __open_2(const char* path,
                      int flags) {  // NOLINT(bugprone-reserved-identifier): open() of some builds
  return open_at(AT_FDCWD, path, flags, 0);
}

EXPORTED std::FILE* fopen(const char* path, const char* mode) {
  using Call = std::FILE* (*)(const char*, const char*);
  return prepare(path, mode) ? reinterpret_cast<Call>(::dlsym(RTLD_NEXT, "fopen"))(path, mode) : nullptr;
}
EXPORTED std::FILE* fopen64(const char* path, const char* mode) {
  using Call = std::FILE* (*)(const char*, const char*);
  return prepare(path, mode) ? reinterpret_cast<Call>(::dlsym(RTLD_NEXT, "fopen64"))(path, mode) : nullptr;
}

EXPORTED ssize_t write(int fd, const void* bytes, std::size_t size) {
  return write_at(fd, bytes, size, -1);
}
EXPORTED ssize_t pwrite(int fd, const void* bytes, std::size_t size, off_t at) {
  return write_at(fd, bytes, size, at);
}
EXPORTED ssize_t pwrite64(int fd, const void* bytes, std::size_t size, off64_t at) {
  return write_at(fd, bytes, size, at);
}
EXPORTED ssize_t writev(int fd, const iovec* parts, int count) {
  Path full{};
  if (!is_ours(fd, full)) return ::syscall(SYS_writev, fd, parts, count);
  ssize_t sum = 0;
  for (int i = 0; i < count; ++i) {
    const ssize_t written = write_at(fd, parts[i].iov_base, parts[i].iov_len, -1);
    if (written < 0) return sum > 0 ? sum : written;
    sum += written;
    if (static_cast<std::size_t>(written) < parts[i].iov_len) break;
  }
  return sum;
}
EXPORTED ssize_t copy_file_range(int from, off64_t* from_at, int to, off64_t* to_at, std::size_t size,
                                 unsigned flags) {
  Path full{};
  if (is_ours(to, full)) return refused(ENOSYS);  // its callers use sendfile() then
  return ::syscall(SYS_copy_file_range, from, from_at, to, to_at, size, flags);
}
EXPORTED ssize_t sendfile(int to, int from, off_t* at, std::size_t size) {
  Path full{};
  if (!is_ours(to, full)) return ::syscall(SYS_sendfile, to, from, at, size);
  std::array<char, 65536> part{};
  const std::size_t most = size < part.size() ? size : part.size();
  const ssize_t got =
      at != nullptr ? ::pread(from, part.data(), most, *at) : ::syscall(SYS_read, from, part.data(), most);
  if (got <= 0) return got;
  const ssize_t written = write_at(to, part.data(), static_cast<std::size_t>(got), -1);
  if (written > 0 && at != nullptr) *at += written;
  return written;
}

EXPORTED int fsync(int fd) {
  return sync(fd, SYS_fsync);
}
EXPORTED int fdatasync(int fd) {
  return sync(fd, SYS_fdatasync);
}
EXPORTED int ftruncate(int fd, off_t size) noexcept {
  return resize(fd, size);
}
EXPORTED int ftruncate64(int fd, off64_t size) noexcept {
  return resize(fd, size);
}
EXPORTED int truncate(const char* path, off_t size) noexcept {
  const int fd = open_at(AT_FDCWD, path, O_WRONLY | O_CLOEXEC, 0);
  if (fd < 0) return -1;
  const int result = resize(fd, size);
  (void)::syscall(SYS_close, fd);
  return result;
}

EXPORTED int rename(const char* from, const char* to) noexcept {
  return change_names(ChangeKind::rename, AT_FDCWD, from, AT_FDCWD, to,
                      [&] { return ::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0U); });
}
EXPORTED int renameat(int from_fd, const char* from, int to_fd, const char* to) noexcept {
  return change_names(ChangeKind::rename, from_fd, from, to_fd, to,
                      [&] { return ::syscall(SYS_renameat2, from_fd, from, to_fd, to, 0U); });
}
EXPORTED int renameat2(int from_fd, const char* from, int to_fd, const char* to, unsigned flags) noexcept {
  return change_names((flags & RENAME_EXCHANGE) != 0 ? ChangeKind::exchange : ChangeKind::rename, from_fd,
                      from, to_fd, to,
                      [&] { return ::syscall(SYS_renameat2, from_fd, from, to_fd, to, flags); });
}
EXPORTED int link(const char* from, const char* to) noexcept {
  return change_names(ChangeKind::link, AT_FDCWD, from, AT_FDCWD, to,
                      [&] { return ::syscall(SYS_linkat, AT_FDCWD, from, AT_FDCWD, to, 0); });
}
EXPORTED int linkat(int from_fd, const char* from, int to_fd, const char* to, int flags) noexcept {
  return change_names(ChangeKind::link, from_fd, from, to_fd, to,
                      [&] { return ::syscall(SYS_linkat, from_fd, from, to_fd, to, flags); });
}
EXPORTED int symlink(const char* target, const char* path) noexcept {
  return change_name(ChangeKind::unknown, AT_FDCWD, path,
                     [&] { return ::syscall(SYS_symlinkat, target, AT_FDCWD, path); });
}
EXPORTED int unlinkat(int folder_fd, const char* path, int flags) noexcept {
  const bool is_folder = (flags & AT_REMOVEDIR) != 0;
  return change_name(is_folder ? ChangeKind::remove_folder : ChangeKind::remove, folder_fd, path,
                     [&] { return ::syscall(SYS_unlinkat, folder_fd, path, flags); });
}
EXPORTED int unlink(const char* path) noexcept {
  return unlinkat(AT_FDCWD, path, 0);
}
EXPORTED int rmdir(const char* path) noexcept {
  return unlinkat(AT_FDCWD, path, AT_REMOVEDIR);
}
EXPORTED int remove(const char* path) noexcept {
  if (unlink(path) == 0) return 0;
  return errno == EISDIR ? rmdir(path) : -1;
}
EXPORTED int mkdirat(int folder_fd, const char* path, mode_t mode) noexcept {
  return change_name(ChangeKind::make_folder, folder_fd, path,
                     [&] { return ::syscall(SYS_mkdirat, folder_fd, path, mode); });
}
EXPORTED int mkdir(const char* path, mode_t mode) noexcept {
  return mkdirat(AT_FDCWD, path, mode);
}

/// The test tells of this moment.
EXPORTED void mark_recording(const char* text) {
  record(ChangeKind::mark, 0, 0, text);
}
