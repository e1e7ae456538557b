#include "instances/runtime/variables/variable_access.hpp"

#include <utility>

namespace plchost {

VariableAccess::VariableAccess(std::vector<DeclaredVariable> variables)
    : table_({}, 0), variables_(std::move(variables)) {
  std::vector<VariableSymbol> symbols;
  symbols.reserve(variables_.size());
  for (const DeclaredVariable& variable : variables_) symbols.push_back(variable.symbol);
  table_ = SymbolTable(std::move(symbols), 0);
}

std::span<std::byte> VariableAccess::bytes(VariableElement element) const noexcept {
  const DeclaredVariable& variable = variables_[element.symbol];
  return {variable.element(element.element), variable.symbol.bytes};
}

}  // namespace plchost
