#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <sys/types.h>

#include "instances/runtime/settings/settings.hpp"
#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/guarded_mapping.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// A stretch of a file or device, whatever path leads to it.
struct FileRange {
  dev_t device = 0;  ///< of a character device itself
  ino_t inode = 0;   ///< 0: a character device
  std::uint64_t begin = 0;
  std::uint64_t end = 0;

  [[nodiscard]] bool overlaps(const FileRange& other) const noexcept {
    return device == other.device && inode == other.inode && begin < other.end && other.begin < end;
  }
};
/// The file that `range` is in, if it is the pool itself or one in which its manager and instances tell of
/// themselves. Nothing: another one, or a memory of the pool. Set-up.
[[nodiscard]] std::optional<std::string> own_file_of_pool(const std::string& pool, const FileRange& range);
/// The whole file of a memory of the pool. Set-up.
[[nodiscard]] std::optional<FileRange> range_of_memory(const std::string& pool, const std::string& name);
/// Of the device or file of these settings. Nothing: there is none. Set-up.
[[nodiscard]] std::optional<FileRange> range_of_device(const AreaSettings& settings);

/// A memory that a start has made in the pool. It is removed again unless the start keeps it: one that fails
/// midway leaves nothing. Set-up.
class MadeInPool {
 public:
  MadeInPool() noexcept = default;
  /// `pool` outlives it, or the call of keep().
  MadeInPool(ObjectPool& pool, std::string name) noexcept : pool_(&pool), name_(std::move(name)) {}
  MadeInPool(MadeInPool&& other) noexcept
      : pool_(std::exchange(other.pool_, nullptr)), name_(std::move(other.name_)) {}
  MadeInPool& operator=(MadeInPool&& other) noexcept {
    std::swap(pool_, other.pool_);
    std::swap(name_, other.name_);
    return *this;
  }
  ~MadeInPool();
  void keep() noexcept { pool_ = nullptr; }

 private:
  ObjectPool* pool_ = nullptr;  ///< null: nothing was made, or it is kept
  std::string name_;
};

/// The memory behind one block of areas, mapped, locked and touched, so that no cycle has a page fault. If
/// others cut its file short, it is zeros from then on.
class AreaMemory {
 public:
  AreaMemory() noexcept = default;

  /// Memory of the process, zeroed. Set-up.
  [[nodiscard]] static Result<AreaMemory> of_process(std::size_t bytes);
  /// A stretch of a device or file. The error names the line of `settings`. Set-up.
  [[nodiscard]] static Result<AreaMemory> of_device(const AreaSettings& settings);
  /// The shared memory `name` of the pool, made with these first contents (zeros behind them) if it is not
  /// there; once it is kept, it outlives the process. An image that firmware has made with a C header alone
  /// is it, too. `exclusive`: nobody else may have it so; busy: somebody has. wrong_size: it has another one.
  /// Set-up.
  [[nodiscard]] static Result<AreaMemory> of_pool(ObjectPool& pool, const std::string& name,
                                                  std::size_t bytes, std::span<const std::byte> contents,
                                                  bool exclusive);
  /// Whether of_device() and of_pool() would find another thing there than they need, as far as that can be
  /// told without opening or making it. Set-up.
  [[nodiscard]] static Result<void> check_device(const AreaSettings& settings);
  /// False: there is no such memory yet.
  [[nodiscard]] static Result<bool> check_pool(const ObjectPool& pool, const std::string& name,
                                               std::size_t bytes);
  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  /// Its file was cut short: writes reach no reader. Any context.
  [[nodiscard]] bool lost() const noexcept { return mapping_.lost() || shared_.lost(); }
  /// It was there already, with what others have written: a device always was.
  [[nodiscard]] bool existed() const noexcept { return existed_; }
  /// It stays in the pool when this object goes. Until then a memory that of_pool() has made goes with it.
  void keep() noexcept { made_.keep(); }

 private:
  GuardedMapping mapping_;  // whole pages; empty: shared_ holds it
  std::span<std::byte> bytes_;
  SharedMemory shared_;
  UniqueFd lock_;
  MadeInPool made_;
  bool existed_ = false;
};

}  // namespace plchost
