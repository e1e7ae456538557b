#pragma once

#include <bit>
#include <cstddef>

#include "instances/plc_app.h"

namespace plchost {

/// Handles of a table's rows are 1, 2, ...: nothing that could be mistaken for an address, and 0 and -1 are
/// none.
[[nodiscard]] inline RTS_HANDLE to_handle(std::size_t index) noexcept {
  return std::bit_cast<RTS_HANDLE>(index + 1);
}

/// Of 0 and -1 it is beyond any table.
[[nodiscard]] inline std::size_t index_of(RTS_HANDLE handle) noexcept {
  return std::bit_cast<std::size_t>(handle) - 1;
}

}  // namespace plchost
