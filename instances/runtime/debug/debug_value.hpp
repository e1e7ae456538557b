#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "shm/base/result.hpp"
#include "shm/variables/variable_type.hpp"

namespace plchost {

/// Where a value of a frame lies: at an address, or so many bytes behind the variables of the POU that the
/// frame is of.
struct ValuePlace {
  VariableType type{};
  std::uint32_t bytes = 0;
  bool of_self = false;
  const std::byte* address = nullptr;
  std::ptrdiff_t offset = 0;

  /// Its bytes; empty: the frame has no variables. Real-time.
  [[nodiscard]] std::span<const std::byte> read(const void* self) const noexcept {
    if (!of_self) return {address, bytes};
    if (self == nullptr) return {};
    return {static_cast<const std::byte*>(self) + offset, bytes};
  }
};

/// Finds the variable that a name means at a breakpoint: the whole name, or one of the POU's own. not_found:
/// says so. Control thread.
using FindValue = std::function<Result<ValuePlace>(std::string_view name)>;

/// A number that holds each value of the elementary types as it is, so that they can be compared: of 64 bits
/// and their sign.
using DebugNumber = long double;
/// Of a type that is no string. Real-time.
[[nodiscard]] DebugNumber number_of(VariableType type, std::span<const std::byte> value) noexcept;

}  // namespace plchost
