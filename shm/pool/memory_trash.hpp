#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "shm/base/unique_fd.hpp"

namespace plchost {

/// Shared memories whose names are gone. The host takes some 150 ms to free a GiB: not as long as somebody
/// holds a lock, so each is held open until the trash goes. If the process ends the host frees them all the
/// same.
class MemoryTrash {
 public:
  MemoryTrash() noexcept = default;
  MemoryTrash(MemoryTrash&& other) noexcept = default;
  MemoryTrash& operator=(MemoryTrash&&) = delete;
  /// Frees them: here if that is a matter of a moment, else in a thread that ends by itself.
  ~MemoryTrash();

  /// Takes the name away if it is there. False: that is not allowed, the file is another user's.
  [[nodiscard]] bool take(const std::string& name) noexcept;
  /// More are to wait for the next one.
  [[nodiscard]] bool full() const noexcept { return held_.size() >= kMost; }

 private:
  static constexpr std::size_t kMost = 32;  // a process may have some 1,000 files open
  std::vector<UniqueFd> held_;
  std::uint64_t bytes_ = 0;
};

}  // namespace plchost
