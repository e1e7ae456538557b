#pragma once

#include <cstdint>

namespace plchost {

/// Counts every allocation of the program between begin() and end(), on any thread. Linked in, it replaces
/// malloc.
class MallocCount {
 public:
  static void begin() noexcept;
  [[nodiscard]] static std::uint64_t end() noexcept;
};

}  // namespace plchost
