#include "shm/pool/client_locks.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/locked_byte.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/open_or_make.hpp"
#include "shm/pool/process_pools.hpp"

namespace plchost {

namespace {

constexpr int kFlags = O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;

// A user who may write the pool may read and write the locks, nobody else may do either.
MemoryRights rights_of_locks(const MemoryRights& pool) noexcept {
  mode_t mode = S_IRUSR | S_IWUSR;
  if ((pool.mode & S_IWGRP) != 0) mode |= S_IRGRP | S_IWGRP;
  if ((pool.mode & S_IWOTH) != 0) mode |= S_IROTH | S_IWOTH;
  return {.owner = pool.owner, .group = pool.group, .mode = mode};
}

// Without opening it: the close would let go of the locks of this process.
Result<struct stat> look_at_file(const std::string& path) {
  struct stat status{};
  if (::lstat(path.c_str(), &status) == 0) return status;
  const int error = errno;
  return failure(error == ENOENT ? ErrorCode::not_found : ErrorCode::system, "cannot examine " + path, error);
}

std::unexpected<Error> not_the_file(const std::string& pool, const std::string& path, int error) {
  return failure(
      ErrorCode::corrupt,
      fmt::format("pool '{}': {}, by which its users see that others run, is not the file that was made with "
                  "it; stop all processes that use the pool, and remove it",
                  pool, path),
      error);
}

}  // namespace

std::string ClientLocks::file_name(std::string_view pool) {
  return fmt::format("{}.clients", pool);
}

Result<std::uint64_t> ClientLocks::make(const std::string& pool, const MemoryRights& rights,
                                        const OwnerCheck& owners) {
  const std::string name = file_name(pool);
  const std::string path = MemoryFile::path(name);
  const auto open = [&]() -> Result<std::uint64_t> {
    PLCHOST_TRY_ASSIGN(const auto status, look_at_file(path));
    if (S_ISREG(status.st_mode) && status.st_nlink == 1 && owners(status.st_uid)) return status.st_ino;
    return failure(
        ErrorCode::refused,
        fmt::format("{} is in the way: it has {}, and was put there by another program; remove it, "
                    "or choose another name for the pool",
                    path, describe_rights(status.st_uid, status.st_gid, status.st_mode)));
  };
  const auto make_it = [&](bool /*replace*/) -> Result<std::uint64_t> {
    // No process has a lock on it yet, so it may be closed again.
    PLCHOST_TRY(MemoryFile::create(name, 1, {}, rights_of_locks(rights)));
    return open();
  };
  return open_or_make(open, make_it, Replaces::nothing);
}

Result<std::shared_ptr<ClientLocks>> ClientLocks::open(const std::string& pool, std::uint64_t file) {
  const std::string path = MemoryFile::path(file_name(pool));
  ProcessPools& pools = ProcessPools::of_this_process();
  const auto held = pools.lock();
  const auto status = look_at_file(path);
  if (!status) return not_the_file(pool, path, status.error().system_errno);
  if (status->st_ino != file) return not_the_file(pool, path, 0);
  if (auto known = pools.find(status->st_dev, file)) return known;
  UniqueFd fd(::open(path.c_str(), kFlags));
  if (!fd) {
    const int error = errno;
    return failure(error == EACCES ? ErrorCode::refused : ErrorCode::system, "cannot open " + path, error);
  }
  struct stat opened{};
  PLCHOST_TRY(check_errno(::fstat(fd.get(), &opened), "cannot examine " + path));
  if (opened.st_ino != file || !S_ISREG(opened.st_mode)) return not_the_file(pool, path, 0);
  std::shared_ptr<ClientLocks> locks(new ClientLocks(path, fd.release(), opened.st_dev, opened.st_ino));
  pools.keep(locks);
  return locks;
}

Result<void> ClientLocks::renew_rights(const std::string& pool, const MemoryRights& rights) {
  const std::string path = MemoryFile::path(file_name(pool));
  ProcessPools& pools = ProcessPools::of_this_process();
  const auto held = pools.lock();
  const auto status = look_at_file(path);
  const auto locks = status ? pools.find(status->st_dev, status->st_ino) : nullptr;
  if (!locks) return {};
  const MemoryRights wanted = rights_of_locks(rights);
  return has_rights(*status, wanted) ? Result<void>() : give_rights(locks->fd_, wanted, path);
}

ClientLocks::~ClientLocks() {
  if (is_open()) ::close(fd_);
}

// The program may have closed what it has not opened, and have another file under that number.
bool ClientLocks::is_open() const noexcept {
  struct stat status{};
  return ::fstat(fd_, &status) == 0 && status.st_dev == device_ && status.st_ino == file_;
}

bool ClientLocks::is_nameless() const noexcept {
  struct stat status{};
  return ::fstat(fd_, &status) != 0 || status.st_ino != file_ || status.st_nlink == 0;
}

std::uint32_t ClientLocks::take_number(std::atomic<std::uint32_t>& numbers) noexcept {
  const auto held = ProcessPools::of_this_process().lock();
  const std::uint32_t known = number_.load(std::memory_order_relaxed);
  return known != 0 ? known : take_number_locked(numbers);
}

// A stranger may have set them back: then those of the living are taken.
std::uint32_t ClientLocks::take_number_locked(std::atomic<std::uint32_t>& numbers) noexcept {
  constexpr int kAttempts = 10'000;
  for (int i = 0; i < kAttempts; ++i) {
    const std::uint32_t next = numbers.fetch_add(1, std::memory_order_relaxed) % ClientMutex::kMaxClient + 1;
    if (lock_byte(fd_, next)) {
      number_.store(next, std::memory_order_relaxed);
      return next;
    }
    if (errno != EAGAIN && errno != EACCES && errno != EINTR) break;
  }
  return 0;
}

Result<void> ClientLocks::renew(std::atomic<std::uint32_t>& numbers) noexcept {
  const auto held = ProcessPools::of_this_process().lock();
  if (!is_open()) {
    UniqueFd fd(::open(path_.c_str(), kFlags));
    struct stat status{};
    if (!fd || ::fstat(fd.get(), &status) != 0 || status.st_ino != file_) {
      return failure(ErrorCode::system, fmt::format("{}: this program has closed it", path_), errno);
    }
    fd_ = fd.release();
  }
  const std::uint32_t known = number_;
  if (known != 0 && lock_byte(fd_, known)) return {};
  number_ = 0;
  if (take_number_locked(numbers) != 0) return {};
  return failure(ErrorCode::system, fmt::format("cannot lock a byte of {}", path_), errno);
}

// A program that closes what it has not opened may have another file there: in doubt the client lives, until
// renew().
bool ClientLocks::lives(std::uint32_t client) const noexcept {
  return holder_of_byte(fd_, client) || !is_open();
}

pid_t ClientLocks::seen_as(std::uint32_t client) const noexcept {
  return holder_of_byte(fd_, client).value_or(ByteHolder{}).pid;
}

}  // namespace plchost
