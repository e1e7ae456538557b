#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/runtime/variables/declared_variable.hpp"
#include "shm/base/result.hpp"
#include "shm/variables/symbol_page.hpp"

namespace plchost {

/// The variables of a version of the application, and where they lie in it. Control thread.
class VariableAccess {
 public:
  /// `variables`: as VariableCollection::take() and check_variables() leave them.
  explicit VariableAccess(std::vector<DeclaredVariable> variables);

  [[nodiscard]] std::span<const VariableSymbol> symbols() const noexcept { return table_.symbols(); }
  [[nodiscard]] const VariableSymbol& symbol(VariableElement element) const noexcept {
    return symbols()[element.symbol];
  }
  [[nodiscard]] bool has(VariableElement element) const noexcept { return table_.has(element); }
  /// As SymbolTable::find().
  [[nodiscard]] Result<VariableElement> find(std::string_view name) const { return table_.find(name); }
  /// The bytes of an element that it has.
  [[nodiscard]] std::span<std::byte> bytes(VariableElement element) const noexcept;
  /// As people write it.
  [[nodiscard]] std::string name(VariableElement element) const {
    return element_name(symbol(element), element.element);
  }
  [[nodiscard]] std::string text(VariableElement element, std::span<const std::byte> value) const {
    return variable_text(symbol(element).type, value);
  }

 private:
  SymbolTable table_;
  std::vector<DeclaredVariable> variables_;  // in the order of the table
};

}  // namespace plchost
