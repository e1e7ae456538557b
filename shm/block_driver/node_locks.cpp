#include "shm/block_driver/node_locks.hpp"

#include <algorithm>
#include <cerrno>
#include <mutex>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/files/open_or_make.hpp"
#include "shm/files/pool_files.hpp"

namespace plchost {

namespace {

constexpr int kFlags = O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;

/// The files that this process has open, each as long as it has its name: a close gives all locks back, also
/// those of a descriptor that was opened meanwhile. Never destroyed: threads end after the static objects of
/// a program.
struct OpenFiles {
  std::mutex mutex;
  std::vector<std::shared_ptr<NodeLocks>> files;

  static OpenFiles& of_this_process() {
    static OpenFiles& files = *[] {
      static OpenFiles* made = nullptr;
      made = new OpenFiles();
      // A child of fork() finds the mutex free.
      (void)::pthread_atfork([] { made->mutex.lock(); }, [] { made->mutex.unlock(); },
                             [] { made->mutex.unlock(); });
      return made;
    }();
    return files;
  }
};

}  // namespace

// The caller holds the mutex of the open files.
Result<std::shared_ptr<NodeLocks>> NodeLocks::open_existing(const std::string& path) {
  const auto not_opened = [&](int error) {
    const ErrorCode code = error == ENOENT  ? ErrorCode::not_found
                           : error == ELOOP ? ErrorCode::wrong_type
                                            : ErrorCode::system;
    return failure(code, "cannot open " + path, error);
  };
  // Not by opening it: the close would give the locks of this process back.
  struct stat status{};
  if (::lstat(path.c_str(), &status) != 0) return not_opened(errno);
  if (!S_ISREG(status.st_mode)) return failure(ErrorCode::wrong_type, path + " is no plain file");
  if (!is_trusted_owner(status.st_uid)) {
    return failure(ErrorCode::refused,
                   fmt::format("{} was put there by another user: {}", path,
                               describe_rights(status.st_uid, status.st_gid, status.st_mode)));
  }
  auto& files = OpenFiles::of_this_process().files;
  std::erase_if(files, [](const auto& file) { return file.use_count() == 1 && file->is_nameless(); });
  const auto known = std::ranges::find_if(files, [&](const auto& file) {
    return file->device_ == status.st_dev && file->inode_ == status.st_ino;
  });
  if (known != files.end()) return *known;
  UniqueFd fd(::open(path.c_str(), kFlags));
  if (!fd) return not_opened(errno);
  struct stat opened{};
  if (::fstat(fd.get(), &opened) != 0 || opened.st_ino != status.st_ino) return not_opened(ENOENT);
  std::shared_ptr<NodeLocks> made(new NodeLocks(path, fd.release(), status.st_dev, status.st_ino));
  files.push_back(made);
  return made;
}

Result<std::shared_ptr<NodeLocks>> NodeLocks::open(std::string_view directory) {
  const std::string name = node_locks_name(directory);
  const std::string path = MemoryFile::path(name);
  const std::scoped_lock held(OpenFiles::of_this_process().mutex);
  const auto make = [&](bool replace) -> Result<std::shared_ptr<NodeLocks>> {
    // No process has a lock on it yet, so it may be closed again.
    PLCHOST_TRY(replace ? MemoryFile::replace(name, 1) : MemoryFile::create(name, 1));
    return open_existing(path);
  };
  return open_or_make([&] { return open_existing(path); }, make, Replaces::foreign);
}

std::shared_ptr<NodeLocks> NodeLocks::find(std::string_view directory) {
  const std::scoped_lock held(OpenFiles::of_this_process().mutex);
  return open_existing(MemoryFile::path(node_locks_name(directory))).value_or(nullptr);
}

void NodeLocks::remove(std::string_view directory) noexcept {
  MemoryFile::remove(node_locks_name(directory));
}

NodeLocks::~NodeLocks() {
  if (is_open()) ::close(fd_);
}

// The program may have closed what it has not opened, and have another file under that number.
bool NodeLocks::is_open() const noexcept {
  struct stat status{};
  return ::fstat(fd_, &status) == 0 && status.st_dev == device_ && status.st_ino == inode_;
}

bool NodeLocks::is_nameless() const noexcept {
  struct stat status{};
  return ::lstat(path_.c_str(), &status) != 0 || status.st_dev != device_ || status.st_ino != inode_;
}

bool NodeLocks::take(std::uint16_t node) noexcept {
  const std::scoped_lock held(OpenFiles::of_this_process().mutex);
  return (is_open() || reopen()) && lock_byte(fd_, node);
}

bool NodeLocks::reopen() noexcept {
  if (is_nameless()) return false;
  UniqueFd fd(::open(path_.c_str(), kFlags));
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0 || status.st_ino != inode_) return false;
  fd_ = fd.release();
  return true;
}

}  // namespace plchost
