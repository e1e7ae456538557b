#include "instances/runtime/application/elf_functions.hpp"

#include <algorithm>

#include <elf.h>

#include "instances/runtime/application/elf_bytes.hpp"

namespace plchost {

namespace {

bool holds(const Elf64_Sym& symbol, std::uint64_t address) noexcept {
  return ELF64_ST_TYPE(symbol.st_info) == STT_FUNC && symbol.st_shndx != SHN_UNDEF &&
         address >= symbol.st_value && address - symbol.st_value < symbol.st_size;
}

}  // namespace

std::vector<std::optional<ElfFunction>> functions_at(const ElfFile& file,
                                                     std::span<const std::uint64_t> addresses) {
  constexpr std::uint64_t kMostSymbolBytes = std::uint64_t{64} << 20;
  constexpr std::size_t kAtOnce = 2048 * sizeof(Elf64_Sym);
  std::vector<std::optional<ElfFunction>> found(addresses.size());
  const auto* const symbols = file.find(std::uint32_t{SHT_SYMTAB});
  const auto* const names = symbols != nullptr ? file.at(symbols->link) : nullptr;
  if (names == nullptr) return found;
  for (std::uint64_t from = 0; from < std::min(symbols->size, kMostSymbolBytes); from += kAtOnce) {
    const auto part = file.read(*symbols, from, kAtOnce);
    for (std::uint64_t i = 0; const auto symbol = elf_item<Elf64_Sym>(part, i); ++i) {
      for (std::size_t place = 0; place < addresses.size(); ++place) {
        if (found[place] || !holds(*symbol, addresses[place])) continue;
        found[place] = ElfFunction{.name = file.text(*names, symbol->st_name),
                                   .offset = addresses[place] - symbol->st_value};
      }
    }
  }
  return found;
}

}  // namespace plchost
