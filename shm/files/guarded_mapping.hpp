#pragma once

#include <cstddef>
#include <span>

#include "shm/guard/memory_guard.hpp"

namespace plchost {

/// Memory that mmap has given, under a guard if there is one left. Unmapped when this goes.
class GuardedMapping {
 public:
  GuardedMapping() noexcept = default;
  explicit GuardedMapping(std::span<std::byte> bytes) noexcept : bytes_(bytes), guard_(bytes) {}
  GuardedMapping(GuardedMapping&& other) noexcept;
  GuardedMapping& operator=(GuardedMapping&& other) noexcept;
  GuardedMapping(const GuardedMapping&) = delete;
  GuardedMapping& operator=(const GuardedMapping&) = delete;
  ~GuardedMapping();

  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  [[nodiscard]] bool guarded() const noexcept { return static_cast<bool>(guard_); }
  [[nodiscard]] bool lost() const noexcept { return guard_.lost(); }

 private:
  std::span<std::byte> bytes_;
  MemoryGuard guard_;
};

}  // namespace plchost
