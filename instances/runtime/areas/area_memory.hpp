#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "instances/runtime/settings/settings.hpp"
#include "shm/base/memory_guard.hpp"
#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/pool/memory_file.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// The memory behind one block of areas, mapped, locked and touched, so that no cycle has a page fault. If
/// others cut its file short, it is zeros from then on.
class AreaMemory {
 public:
  AreaMemory() noexcept = default;
  AreaMemory(AreaMemory&& other) noexcept;
  AreaMemory& operator=(AreaMemory&& other) noexcept;
  AreaMemory(const AreaMemory&) = delete;
  AreaMemory& operator=(const AreaMemory&) = delete;
  ~AreaMemory();

  /// Memory of the process, zeroed. Set-up.
  [[nodiscard]] static Result<AreaMemory> of_process(std::size_t bytes);
  /// A stretch of a device or file. The error names the line of `settings`. Set-up.
  [[nodiscard]] static Result<AreaMemory> of_device(const AreaSettings& settings);
  /// The shared memory `name` of the pool, made (zeroed) if it is not there; it outlives the process.
  /// Firmware that knows only a C header makes the file alone: then that is it. `exclusive`: nobody else may
  /// have it so; busy: somebody has. wrong_size: it has another one. Set-up.
  [[nodiscard]] static Result<AreaMemory> of_pool(ObjectPool& pool, const std::string& name,
                                                  std::size_t bytes, bool exclusive);
  /// The memory file of that name, of so many bytes. Set-up.
  [[nodiscard]] static Result<AreaMemory> of_file(const std::string& file, std::size_t bytes);

  /// A new one that takes the place of an old one of the name; it has the name only when `fill` has written
  /// it. Set-up.
  [[nodiscard]] static Result<AreaMemory> new_file(const std::string& file, std::size_t bytes,
                                                   const MemoryFile::Fill& fill);

  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  /// of_pool: it was there already.
  [[nodiscard]] bool existed() const noexcept { return existed_; }
  /// Its file was cut short.
  [[nodiscard]] bool lost() const noexcept { return guard_.lost(); }

 private:
  [[nodiscard]] static Result<AreaMemory> of(MemoryFile memory, const std::string& file, std::size_t bytes);

  std::span<std::byte> mapping_;  // whole pages; empty: file_ holds it
  std::span<std::byte> bytes_;
  MemoryFile file_;
  SharedMemory shared_;
  UniqueFd lock_;
  MemoryGuard guard_;
  bool existed_ = false;
};

}  // namespace plchost
