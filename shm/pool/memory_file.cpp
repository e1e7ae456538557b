#include "shm/pool/memory_file.hpp"

#include <cerrno>
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
constexpr mode_t kMode = 0660;

Result<std::string> path_of(const std::string& name) {
  if (auto valid = check_name("shared memory name", name, kMaxFileName); !valid) {
    return std::unexpected(valid.error());
  }
  return fmt::format("{}/{}", MemoryFile::kDirectory, name);
}

Result<std::span<std::byte>> map(const UniqueFd& fd, std::size_t size, MemoryFile::Access access,
                                 const std::string& path) {
  const int protection = access == MemoryFile::Access::read_write ? PROT_READ | PROT_WRITE : PROT_READ;
  void* const address = ::mmap(nullptr, size, protection, MAP_SHARED, fd.get(), 0);
  if (address == MAP_FAILED) {
    const int error = errno;
    return failure(ErrorCode::system, fmt::format("map {} bytes of {}", size, path), error);
  }
  return std::span(static_cast<std::byte*>(address), size);
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
  return check_returned(error, fmt::format("allocate {} bytes for {}", size, path));
}

Result<UniqueFd> make_nameless(std::size_t size, const std::string& path) {
  if (size == 0) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("shared memory {} must have at least 1 byte", path));
  }
  // Without a name until it is complete: there is no half-made one for others to find or to clean up after.
  UniqueFd fd(::open(MemoryFile::kDirectory, O_TMPFILE | O_RDWR | O_CLOEXEC, kMode));
  if (!fd) {
    const int error = errno;
    return failure(ErrorCode::system, fmt::format("make shared memory in {}", MemoryFile::kDirectory), error);
  }
  if (auto mode = check_errno(::fchmod(fd.get(), kMode), "fchmod " + path); !mode) {
    return std::unexpected(mode.error());
  }
  if (auto allocated = allocate(fd, size, path); !allocated) return std::unexpected(allocated.error());
  return fd;
}

Result<void> give_name(const UniqueFd& fd, const std::string& path) {
  const std::string self = fmt::format("/proc/self/fd/{}", fd.get());
  if (::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW) == 0) return {};
  const int error = errno;
  if (error == EEXIST) return failure(ErrorCode::already_exists, fmt::format("{} exists already", path));
  return failure(ErrorCode::system, fmt::format("give shared memory the name {}", path), error);
}

/// An existing file, and what it is.
struct Opened {
  UniqueFd fd;
  struct stat status{};
};

Result<Opened> open_existing(const std::string& path, MemoryFile::Access access) {
  // O_NONBLOCK: were it a FIFO, a plain open would wait for ever.
  const int flags =
      (access == MemoryFile::Access::read_write ? O_RDWR : O_RDONLY) | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  Opened opened{.fd = UniqueFd(::open(path.c_str(), flags))};
  if (!opened.fd) {
    const int error = errno;
    return failure(error == ENOENT ? ErrorCode::not_found : ErrorCode::system, fmt::format("open {}", path),
                   error);
  }
  if (auto got = check_errno(::fstat(opened.fd.get(), &opened.status), "fstat " + path); !got) {
    return std::unexpected(got.error());
  }
  if (!S_ISREG(opened.status.st_mode)) {
    return failure(ErrorCode::corrupt, fmt::format("{} is not a plain file", path));
  }
  return opened;
}

}  // namespace

Result<MemoryFile> MemoryFile::make(const std::string& name, std::size_t size, const Fill& fill,
                                    bool take_over) {
  const auto path = path_of(name);
  if (!path) return std::unexpected(path.error());
  const auto fd = make_nameless(size, *path);
  if (!fd) return std::unexpected(fd.error());
  const auto bytes = map(*fd, size, Access::read_write, *path);
  if (!bytes) return std::unexpected(bytes.error());
  MemoryFile file(*bytes);
  if (fill) {
    if (auto filled = fill(*bytes); !filled) return std::unexpected(filled.error());
  }
  constexpr int kAttempts = 10;  // each one fails only if another process makes the name anew in between
  for (int attempt = 1;; ++attempt) {
    const auto named = give_name(*fd, *path);
    if (named) return file;
    if (!take_over || named.error().code != ErrorCode::already_exists || attempt == kAttempts) {
      return std::unexpected(named.error());
    }
    ::unlink(path->c_str());
  }
}

Result<MemoryFile> MemoryFile::create(const std::string& name, std::size_t size, const Fill& fill) {
  return make(name, size, fill, false);
}

Result<MemoryFile> MemoryFile::replace(const std::string& name, std::size_t size, const Fill& fill) {
  return make(name, size, fill, true);
}

Result<MemoryFile> MemoryFile::open(const std::string& name, std::size_t at_least, Access access) {
  const auto path = path_of(name);
  if (!path) return std::unexpected(path.error());
  const auto opened = open_existing(*path, access);
  if (!opened) return std::unexpected(opened.error());
  const auto size = static_cast<std::size_t>(opened->status.st_size);
  if (size == 0 || size < at_least) {
    return failure(ErrorCode::corrupt,
                   fmt::format("{} has {} bytes, at least {} are needed", *path, size, at_least));
  }
  const auto bytes = map(opened->fd, size, access, *path);
  if (!bytes) return std::unexpected(bytes.error());
  return MemoryFile(*bytes);
}

Result<void> MemoryFile::fill_empty(const std::string& name, std::size_t size) {
  const auto path = path_of(name);
  if (!path) return std::unexpected(path.error());
  const auto opened = open_existing(*path, Access::read_write);
  if (!opened) return std::unexpected(opened.error());
  if (opened->status.st_size != 0) return {};
  return allocate(opened->fd, size, *path);
}

void MemoryFile::remove(const std::string& name) noexcept {
  if (const auto path = path_of(name)) ::unlink(path->c_str());
}

MemoryFile::MemoryFile(MemoryFile&& other) noexcept : bytes_(std::exchange(other.bytes_, {})) {}

MemoryFile& MemoryFile::operator=(MemoryFile&& other) noexcept {
  if (this != &other) {
    const MemoryFile old(std::exchange(bytes_, std::exchange(other.bytes_, {})));
  }
  return *this;
}

MemoryFile::~MemoryFile() {
  if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size());
}

}  // namespace plchost
