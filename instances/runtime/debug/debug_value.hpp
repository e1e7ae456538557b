#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "instances/plc_debug.h"
#include "shm/base/result.hpp"
#include "shm/variables/variable_type.hpp"

namespace plchost {

/// Where the local variable with this number in Plc_Pou::pLocals lies; null: this call has none. Real-time.
[[nodiscard]] inline std::byte* local_address(const Plc_Frame& frame, std::uint32_t local) noexcept {
  if (frame.ppLocals == nullptr || local < frame.dwFirstLocal || local - frame.dwFirstLocal >= frame.nLocals)
    return nullptr;
  return static_cast<std::byte*>(frame.ppLocals[local - frame.dwFirstLocal]);
}

/// Where a value of a frame lies.
struct ValuePlace {
  enum class Base : std::uint8_t {
    address,
    self,   ///< so many bytes behind the variables of the POU that the frame is of
    local,  ///< so many bytes behind the frame's local variable of this number
  };
  VariableType type{};
  std::uint32_t bytes = 0;
  Base base = Base::address;
  const std::byte* address = nullptr;
  std::ptrdiff_t offset = 0;
  std::uint32_t local = 0;

  /// Its bytes; empty: the frame has no such variable. Real-time.
  [[nodiscard]] std::span<const std::byte> read(const Plc_Frame& frame) const noexcept {
    const std::byte* const found = base == Base::address ? address
                                   : base == Base::local ? local_address(frame, local)
                                                         : static_cast<const std::byte*>(frame.pSelf);
    if (found == nullptr) return {};
    return {base == Base::address ? found : found + offset, bytes};
  }
};

/// Finds the variable that a name means at a breakpoint: a local one, else one of the POU's own, else that of
/// the whole name. not_found: says so. Control thread.
using FindValue = std::function<Result<ValuePlace>(std::string_view name)>;

/// A number that holds each value of the elementary types as it is, so that they can be compared: of 64 bits
/// and their sign.
using DebugNumber = long double;
/// Of a type that is no string. Real-time.
[[nodiscard]] DebugNumber number_of(VariableType type, std::span<const std::byte> value) noexcept;

}  // namespace plchost
