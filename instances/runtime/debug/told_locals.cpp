#include "instances/runtime/debug/told_locals.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "instances/runtime/debug/debug_value.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

// The least that a variable or an element has beside its texts.
constexpr std::size_t kAroundVariable = std::string_view(R"({"name":"","type":"","value":""})").size();
constexpr std::size_t kAroundElement = std::string_view(R"("",)").size();

Json told_local(const DeclaredLocal& local, const std::byte* address, std::size_t most_elements,
                TextBudget& budget) {
  const VariableSymbol& symbol = local.symbol;
  const auto text_at = [&](std::uint32_t offset) {
    std::string text = variable_text(symbol.type, std::span(address + offset, symbol.bytes));
    budget.spend(text.size());
    return text;
  };
  const std::string type =
      symbol.dimensions.empty() ? std::string(traits_of(symbol.type).name) : type_text(symbol);
  budget.spend(kAroundVariable + symbol.name.size() + type.size());
  if (symbol.dimensions.empty()) return {{"name", symbol.name}, {"type", type}, {"value", text_at(0)}};
  Json elements = Json::array();
  const std::size_t count = std::min<std::size_t>(symbol.elements(), most_elements);
  for (std::uint32_t i = 0; i < count && !budget.is_spent(); ++i) {
    elements.push_back(text_at(local.offset(i)));
    budget.spend(kAroundElement);
  }
  return {{"name", symbol.name}, {"type", type}, {"elements", std::move(elements)}};
}

}  // namespace

Json told_locals(const Plc_Frame& frame, const DeclaredPou& pou, std::size_t most_elements,
                 TextBudget& budget) {
  Json locals = Json::array();
  for (std::uint32_t i = 0; i < pou.locals.size() && !budget.is_spent(); ++i) {
    const DeclaredLocal& local = pou.locals[i];
    const std::byte* const address = local_address(frame, i);
    if (address == nullptr || !local.is_at(frame.dwLine)) continue;
    locals.push_back(told_local(local, address, most_elements, budget));
  }
  return locals;
}

}  // namespace plchost
