#include "instances/runtime/symbol_name.hpp"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <cxxabi.h>
#include <dlfcn.h>
#include <elf.h>
#include <fmt/format.h>

namespace plchost {

namespace {

/// The function that an address lies in.
struct Function {
  std::string name;
  std::uint64_t offset = 0;
};

std::string demangled(const char* name) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> readable(
      abi::__cxa_demangle(name, nullptr, nullptr, &status), &std::free);
  return readable ? std::string(readable.get()) : std::string(name);
}

/// One ELF file in memory. Reads nothing beyond its end, whatever the file says.
class ElfFile {
 public:
  explicit ElfFile(const char* path) {
    std::ifstream file(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }

  [[nodiscard]] std::optional<Function> function_at(std::uint64_t address) const {
    const auto header = read<Elf64_Ehdr>(0);
    if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0 ||
        header->e_ident[EI_CLASS] != ELFCLASS64)
      return std::nullopt;
    for (unsigned i = 0; i < header->e_shnum; ++i) {
      const auto section = read<Elf64_Shdr>(header->e_shoff + std::uint64_t{i} * sizeof(Elf64_Shdr));
      if (!section || section->sh_type != SHT_SYMTAB) continue;
      const auto names =
          read<Elf64_Shdr>(header->e_shoff + std::uint64_t{section->sh_link} * sizeof(Elf64_Shdr));
      if (names) return function_in(*section, *names, address);
    }
    return std::nullopt;
  }

 private:
  template <class T>
  [[nodiscard]] std::optional<T> read(std::uint64_t offset) const {
    if (offset > bytes_.size() || bytes_.size() - offset < sizeof(T)) return std::nullopt;
    T value;
    std::memcpy(&value, bytes_.data() + offset, sizeof(T));
    return value;
  }

  [[nodiscard]] std::optional<Function> function_in(const Elf64_Shdr& symbols, const Elf64_Shdr& names,
                                                    std::uint64_t address) const {
    for (std::uint64_t at = 0; at < symbols.sh_size; at += sizeof(Elf64_Sym)) {
      const auto symbol = read<Elf64_Sym>(symbols.sh_offset + at);
      if (!symbol) break;
      const bool function = ELF64_ST_TYPE(symbol->st_info) == STT_FUNC && symbol->st_shndx != SHN_UNDEF;
      if (!function || address < symbol->st_value || address - symbol->st_value >= symbol->st_size) continue;
      const std::uint64_t name = names.sh_offset + symbol->st_name;
      if (name >= bytes_.size()) break;
      const std::size_t length = ::strnlen(bytes_.data() + name, bytes_.size() - name);
      return Function{.name = demangled(std::string(bytes_.data() + name, length).c_str()),
                      .offset = address - symbol->st_value};
    }
    return std::nullopt;
  }

  std::vector<char> bytes_;
};

}  // namespace

std::string symbol_name(std::uintptr_t address) {
  Dl_info info{};
  // NOLINTNEXTLINE(performance-no-int-to-ptr): it is an address
  if (address == 0 || ::dladdr(reinterpret_cast<const void*>(address), &info) == 0 ||
      info.dli_fname == nullptr)
    return {};
  const std::string file = std::filesystem::path(info.dli_fname).filename();
  const auto in_file = address - reinterpret_cast<std::uintptr_t>(info.dli_fbase);
  if (const auto function = ElfFile(info.dli_fname).function_at(in_file)) {
    return fmt::format("{}+{:#x} in {}", function->name, function->offset, file);
  }
  if (info.dli_sname != nullptr) {
    const auto offset = address - reinterpret_cast<std::uintptr_t>(info.dli_saddr);
    return fmt::format("{}+{:#x} in {}", demangled(info.dli_sname), offset, file);
  }
  return fmt::format("{}+{:#x}", file, in_file);
}

}  // namespace plchost
