#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "instances/plc_app.h"
#include "shm/base/result.hpp"

namespace plchost {

/// A task that uses an area, as the application declared it.
struct AreaUse {
  std::string task;
  std::uint32_t offset = 0;  ///< output: of the bytes that this task alone writes
  std::uint32_t bytes = 0;   ///< 0: none
  void** address = nullptr;  ///< in the application; may be null
};

/// An area as the application declared it, checked but for the names of its tasks.
struct DeclaredArea {
  std::string name;
  std::uint32_t flags = 0;
  std::uint32_t bytes = 0;
  std::uint64_t layout = 0;
  std::vector<AreaUse> uses;  ///< empty: all tasks
  std::vector<std::byte> initial;
  void** address = nullptr;  ///< in the application; may be null

  [[nodiscard]] bool is_input() const noexcept { return (flags & PLC_AREA_INPUT) != 0; }
  [[nodiscard]] bool is_output() const noexcept { return (flags & PLC_AREA_OUTPUT) != 0; }
  [[nodiscard]] bool has_image() const noexcept { return is_input() || is_output(); }
  [[nodiscard]] bool is_retain() const noexcept {
    return (flags & (PLC_AREA_RETAIN | PLC_AREA_PERSISTENT)) != 0;
  }
};

/// Takes over what an application declares. invalid_argument: the fault, and the allowed values. Control
/// thread.
[[nodiscard]] Result<DeclaredArea> from_declaration(const Plc_Area& area);

/// Gives each area without uses those of all tasks, and checks the names and ranges of the others. The error
/// names area and task. Set-up.
[[nodiscard]] Result<void> complete_uses(std::vector<DeclaredArea>& areas,
                                         std::span<const std::string> tasks);

}  // namespace plchost
