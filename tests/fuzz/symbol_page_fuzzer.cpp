#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "shm/variables/symbol_page.hpp"
#include "tests/support/own_name.hpp"

namespace {

using namespace plchost;

/// A page as the runtime makes it.
std::vector<std::byte> good_page() {
  const std::string pool = own_name("fuzz");
  std::vector<VariableSymbol> symbols(2);
  symbols[0] = {.name = "Grid[][]",
                .type = VariableType::int_,
                .read_only = true,
                .bytes = 2,
                .dimensions = {{.first = 1, .count = 2}, {.first = -1, .count = 3}},
                .task = "Main",
                .area = "%QX0.1"};
  symbols[1] = {.name = "name",
                .type = VariableType::string,
                .read_only = false,
                .bytes = 81,
                .dimensions = {},
                .task = {},
                .area = {}};
  if (!SymbolPage::create(pool, "i", symbols)) std::abort();
  const auto memory = MemoryFile::open(symbol_page_name(pool, "i"), 1, MemoryFile::Access::read_only).value();
  SymbolPage::remove(pool, "i");
  return {memory.bytes().begin(), memory.bytes().end()};
}

}  // namespace

// A page with bytes of a stranger is refused as corrupt, or is a table in which all names are found. Then any
// text is a name or a pattern for it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::byte> kGood = good_page();
  std::vector<std::byte> page = kGood;
  std::size_t at = 0;
  for (; at + 1 < size && at < 16; at += 2) page[data[at] % page.size()] = std::byte{data[at + 1]};
  const std::string_view text(reinterpret_cast<const char*>(data) + std::min(at, size),
                              size - std::min(at, size));
  auto table = SymbolTable::parse("page", page);
  if (!table && table.error().code != ErrorCode::corrupt) std::abort();
  if (!table) table = SymbolTable::parse("page", kGood);
  for (std::uint32_t i = 0; i < table->symbols().size(); ++i) {
    const VariableSymbol& symbol = table->symbols()[i];
    const VariableElement last{.symbol = i, .element = symbol.elements() - 1};
    const auto found = table->find(element_name(symbol, last.element));
    if (!found || *found != last) std::abort();
  }
  if (const auto named = table->find(text); named && !table->has(*named)) std::abort();
  for (const auto& match : table->match(text)) {
    for (const auto element : match.elements)
      if (!table->has({.symbol = match.symbol, .element = element})) std::abort();
  }
  return 0;
}
