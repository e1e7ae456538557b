#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The memory that this process has mapped, as it is when asked.
class MemoryMap {
 public:
  [[nodiscard]] static Result<MemoryMap> of_this_process();
  /// The text of /proc/PID/maps.
  [[nodiscard]] static MemoryMap parse(std::string_view maps);

  /// Whether all these bytes, at least one, can be read, and written if that is asked for.
  [[nodiscard]] bool allows(std::uintptr_t begin, std::uint64_t bytes, bool to_write) const noexcept;

 private:
  struct Part {
    std::uintptr_t begin;
    std::uintptr_t end;
    bool write;
  };
  std::vector<Part> parts_;  // that can be read; ascending
};

}  // namespace plchost
