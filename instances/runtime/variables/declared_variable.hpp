#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "instances/plc_app.h"
#include "shm/base/result.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

/// A variable as the application declared it, checked but for its task and its address.
struct DeclaredVariable {
  VariableSymbol symbol;
  std::byte* address = nullptr;  ///< in the application; of an array's first element
  std::array<std::uint32_t, kMaxVariableDimensions> strides{};

  [[nodiscard]] std::byte* element(std::uint32_t number) const noexcept;
  /// From the first byte of the first element to the last one of the last element.
  [[nodiscard]] std::uint64_t extent() const noexcept;
};

/// Takes over what an application declares. invalid_argument: the variable, its fault, and what is allowed.
/// Control thread.
[[nodiscard]] Result<DeclaredVariable> from_declaration(const Plc_Variable& variable);

/// plc_declare_variable: checks it and adds it to `variables`, of which each name is there once. The log has
/// the reason of a refusal. Control thread.
class VariableCollection {
 public:
  [[nodiscard]] RTS_RESULT declare(const Plc_Variable* variable);
  /// In the order of their declaration.
  [[nodiscard]] std::span<const DeclaredVariable> variables() const noexcept { return variables_; }
  /// In the order of compare_variable_names(). Once.
  [[nodiscard]] std::vector<DeclaredVariable> take();

 private:
  std::vector<DeclaredVariable> variables_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>>
      names_;  // by the hash of a name, without regard to case
};

/// Whether the tasks are there, and all bytes of the variables are memory of this process that can be read,
/// and written unless they are read-only. invalid_argument: names the first that is not. Set-up.
[[nodiscard]] Result<void> check_variables(std::span<const DeclaredVariable> variables,
                                           std::span<const std::string> tasks);

}  // namespace plchost
