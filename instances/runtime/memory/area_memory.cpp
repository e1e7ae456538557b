#include "instances/runtime/memory/area_memory.hpp"

#include <cerrno>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/files/registers.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

std::unexpected<Error> not_mapped(const AreaSettings& settings, std::string_view what, int error = 0) {
  return failure(ErrorCode::refused,
                 fmt::format("{}: [SysMem] Area.{}: {:#x} bytes at {:#x} of {}: {}", settings.where,
                             settings.number, settings.size, settings.address, settings.device, what),
                 error);
}

// `status` is that of an open file.
FileRange range_in(const struct stat& status, std::uint64_t begin, std::uint64_t end) noexcept {
  const bool device = S_ISCHR(status.st_mode);
  return {.device = device ? status.st_rdev : status.st_dev,
          .inode = device ? 0 : status.st_ino,
          .begin = begin,
          .end = end};
}

Result<void> check_file(const AreaSettings& settings, const struct stat& status) {
  if (!S_ISREG(status.st_mode) && !S_ISCHR(status.st_mode)) {
    return not_mapped(settings, "allowed is a character device or a plain file");
  }
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (S_ISREG(status.st_mode) && (settings.address > size || settings.size > size - settings.address)) {
    return not_mapped(settings, fmt::format("the file ends at {:#x}", size));
  }
  return {};
}

Result<UniqueFd> open_device(const AreaSettings& settings) {
  UniqueFd fd(::open(settings.device.c_str(), O_RDWR | O_SYNC | O_CLOEXEC | O_NONBLOCK));
  if (!fd) return not_mapped(settings, "cannot be opened", errno);
  struct stat status{};
  if (::fstat(fd.get(), &status) != 0) return not_mapped(settings, "fstat", errno);
  PLCHOST_TRY(check_file(settings, status));
  return fd;
}

// The kernel takes it back when the process ends, however it ends.
Result<UniqueFd> lock_file_of(const std::string& file) {
  const std::string path = MemoryFile::path(file);
  UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!fd) return failure(ErrorCode::system, "cannot open " + path, errno);
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) return fd;
  const int error = errno;
  if (error != EWOULDBLOCK) return failure(ErrorCode::system, "cannot lock " + path, error);
  return failure(ErrorCode::busy, fmt::format("{} has a writer already: another process", path));
}

}  // namespace

std::optional<std::string> own_file_of_pool(const std::string& pool, const FileRange& range) {
  std::error_code error;
  for (std::filesystem::directory_iterator at(MemoryFile::kDirectory, error), end; !error && at != end;
       at.increment(error)) {
    const std::string file = at->path().filename();
    const bool own = file == pool || (file.starts_with(pool + ".") && !memory_of_file(pool, file));
    struct stat status{};
    if (!own || ::stat(at->path().c_str(), &status) != 0) continue;
    if (status.st_dev == range.device && status.st_ino == range.inode) return at->path();
  }
  return std::nullopt;
}

std::optional<FileRange> range_of_memory(const std::string& pool, const std::string& name) {
  const std::string path = MemoryFile::path(pool_memory_name(pool, name));
  struct stat status{};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return range_in(status, 0, static_cast<std::uint64_t>(status.st_size));
}

std::optional<FileRange> range_of_device(const AreaSettings& settings) {
  struct stat status{};
  if (::stat(settings.device.c_str(), &status) != 0) return std::nullopt;
  return range_in(status, settings.address, settings.address + settings.size);
}

MadeInPool::~MadeInPool() {
  if (pool_ == nullptr) return;
  const auto removed = pool_->remove_object(name_);
  if (!removed) spdlog::warn("shared memory '{}' stays in the pool: {}", name_, removed.error().describe());
}

Result<void> AreaMemory::check_device(const AreaSettings& settings) {
  struct stat status{};
  const bool there = ::stat(settings.device.c_str(), &status) == 0 &&
                     ::faccessat(AT_FDCWD, settings.device.c_str(), R_OK | W_OK, AT_EACCESS) == 0;
  if (!there) return not_mapped(settings, "cannot be opened", errno);
  return check_file(settings, status);
}

Result<bool> AreaMemory::check_pool(const ObjectPool& pool, const std::string& name, std::size_t bytes) {
  PLCHOST_TRY_ASSIGN(const auto known, if_found(pool.look_at(name)));
  if (!known) return false;
  if (known->type != ObjectType::memory) {
    return failure(ErrorCode::wrong_type,
                   fmt::format("'{}' is no shared memory but a {}", name, to_string(known->type)));
  }
  if (known->size == bytes) return true;
  return failure(ErrorCode::wrong_size,
                 fmt::format("shared memory '{}' has {} bytes, {} were asked for", name, known->size, bytes));
}

Result<AreaMemory> AreaMemory::of_process(std::size_t bytes) {
  AreaMemory memory;
  void* const address =
      ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (address == MAP_FAILED) {
    const int error = errno;
    return failure(ErrorCode::full, fmt::format("cannot allocate {} bytes of memory for areas", bytes),
                   error);
  }
  memory.mapping_ = GuardedMapping(std::span(static_cast<std::byte*>(address), bytes));
  memory.bytes_ = memory.mapping_.bytes();
  return memory;
}

Result<AreaMemory> AreaMemory::of_device(const AreaSettings& settings) {
  PLCHOST_TRY_ASSIGN(const auto fd, open_device(settings));
  auto mapped = map_registers(fd.get(), settings.device, settings.address, settings.size);
  if (!mapped) return not_mapped(settings, "cannot be mapped", mapped.error().system_errno);
  AreaMemory memory;
  memory.mapping_ = std::move(mapped->pages);
  memory.bytes_ = mapped->bytes;
  memory.existed_ = true;
  if (!memory.mapping_.guarded()) {
    return not_mapped(settings, fmt::format("more than {} memories of others", MemoryGuard::kMost));
  }
  return memory;
}

Result<AreaMemory> AreaMemory::of_pool(ObjectPool& pool, const std::string& name, std::size_t bytes,
                                       std::span<const std::byte> contents, bool exclusive) {
  PLCHOST_TRY_ASSIGN(auto created, pool.create_memory(name, bytes, {.keep = true}, contents));
  AreaMemory memory;
  memory.existed_ = !created.made;
  if (created.made) memory.made_ = MadeInPool(pool, name);
  memory.shared_ = std::move(created.object);
  memory.bytes_ = memory.shared_.bytes();
  if (!memory.shared_.guarded()) {
    return failure(ErrorCode::full, fmt::format("shared memory '{}': more than {} memories of others", name,
                                                MemoryGuard::kMost));
  }
  if (exclusive) {
    PLCHOST_TRY_ASSIGN(memory.lock_, lock_file_of(pool_memory_name(pool.name(), name)));
  }
  return memory;
}

}  // namespace plchost
