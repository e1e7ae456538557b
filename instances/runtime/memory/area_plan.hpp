#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "instances/runtime/memory/declared_area.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// A stretch of memory that holds one area, or several one behind the other: inputs, or outputs, or others.
/// In a device or file there may be a block of each kind in the same stretch.
struct AreaBlock {
  const AreaSettings* settings =
      nullptr;  ///< null: memory of the process; retain and persistent: retain memory
  std::uint64_t bytes = 0;
  std::vector<std::size_t> areas;  ///< in the order in which they were declared
};

/// Which area lies where.
struct AreaPlan {
  struct Place {
    std::size_t block = 0;
    std::uint64_t offset = 0;  ///< in the block; a multiple of kAreaAlignment
  };
  std::vector<AreaBlock> blocks;
  std::vector<Place> places;  ///< of each declared area
};

/// Whether an area of these flags goes to a configured one of those. If it has bits of the user's, they and
/// nothing else must be among the other's; else all of its kinds. So an area with {attribute 'location' :=
/// '16#8000'} passes 0x0EFF by and takes 0x8000.
[[nodiscard]] bool flags_match(std::uint32_t declared, std::uint32_t configured) noexcept;

/// Places the areas: each in the first configured one that matches, behind those declared before it. An area
/// that none matches has a block of its own; all retain and persistent ones together have one. The error
/// names the line of the configured area. Set-up.
[[nodiscard]] Result<AreaPlan> plan_areas(std::span<const DeclaredArea> areas,
                                          std::span<const AreaSettings> settings);

}  // namespace plchost
