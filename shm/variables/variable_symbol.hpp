#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/variables/variable_type.hpp"

namespace plchost {

inline constexpr std::size_t kMaxVariableName = 250;
inline constexpr std::size_t kMaxVariableArea = 31;
inline constexpr std::size_t kMaxVariables = 65536;
inline constexpr std::size_t kMaxVariableDimensions = 3;
inline constexpr std::uint32_t kMaxVariableBytes = 4096;  ///< of one value: a string's memory
/// Of a variable's array, all dimensions together.
inline constexpr std::uint32_t kMaxVariableElements = 1U << 24U;

/// A dimension of an array, without what only its process knows.
struct VariableDimension {
  std::int32_t first = 0;
  std::uint32_t count = 0;
  bool operator==(const VariableDimension&) const = default;
};

/// A variable of an application as other processes know it.
struct VariableSymbol {
  std::string name = {};  ///< as declared: "Pump[].speed"
  VariableType type{};
  bool read_only = false;
  std::uint32_t bytes = 0;  ///< of one element
  std::vector<VariableDimension> dimensions = {};
  std::string task = {};  ///< the only one that uses it; empty: any
  std::string area = {};  ///< for people: "%QX0.1"; empty: nowhere

  /// All dimensions together; 1: it is no array.
  [[nodiscard]] std::uint32_t elements() const noexcept;
  bool operator==(const VariableSymbol&) const = default;
};

/// invalid_argument: a name, type, number of bytes or dimension that is not allowed; the text says which,
/// without the name of the variable.
[[nodiscard]] Result<void> check_symbol(const VariableSymbol& symbol);

/// The order of a table: by name without regard to case. Negative, 0, positive.
[[nodiscard]] int compare_variable_names(std::string_view left, std::string_view right) noexcept;
[[nodiscard]] inline bool same_variable_name(std::string_view left, std::string_view right) noexcept {
  return compare_variable_names(left, right) == 0;
}

/// invalid_argument: `name` is that of a structure or function block, which has no value of its own.
/// `member`: the name of one of its members.
[[nodiscard]] Error has_members(std::string_view name, std::string_view member);

/// "INT", "STRING[80]", "ARRAY [1..10, 0..3] OF INT".
[[nodiscard]] std::string type_text(const VariableSymbol& symbol);
/// "Pump[2].speed": the name of element number `element` (row-major, from 0); of no array: its name.
[[nodiscard]] std::string element_name(const VariableSymbol& symbol, std::uint32_t element);
/// The numbers that element `element` has in each dimension, from 0.
[[nodiscard]] std::array<std::uint32_t, kMaxVariableDimensions> places_of(const VariableSymbol& symbol,
                                                                          std::uint32_t element) noexcept;

/// One element of a variable of a table: how processes name a value among themselves.
struct VariableElement {
  std::uint32_t symbol = 0;   ///< number in the table
  std::uint32_t element = 0;  ///< row-major, from 0
  bool operator==(const VariableElement&) const = default;
};

}  // namespace plchost
