#include "instances/runtime/application/symbol_name.hpp"

#include <algorithm>
#include <cstdint>
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

#include "instances/runtime/application/elf_bytes.hpp"
#include "shm/base/names.hpp"

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

std::optional<Function> function_in(ElfBytes symbols, ElfBytes names, std::uint64_t address) {
  for (std::uint64_t i = 0; const auto symbol = elf_item<Elf64_Sym>(symbols, i); ++i) {
    const bool function = ELF64_ST_TYPE(symbol->st_info) == STT_FUNC && symbol->st_shndx != SHN_UNDEF;
    if (!function || address < symbol->st_value || address - symbol->st_value >= symbol->st_size) continue;
    if (symbol->st_name >= names.size()) break;
    const ElfBytes rest = names.subspan(symbol->st_name);
    const auto* const name = reinterpret_cast<const char*>(rest.data());
    return Function{.name = demangled(std::string(name, ::strnlen(name, rest.size())).c_str()),
                    .offset = address - symbol->st_value};
  }
  return std::nullopt;
}

// The full symbol table, which the dynamic loader does not read: it knows the program's own functions, too.
std::optional<Function> function_at(ElfBytes file, std::uint64_t address) {
  const auto header = elf_item<Elf64_Ehdr>(file, 0);
  if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0 ||
      header->e_ident[EI_CLASS] != ELFCLASS64)
    return std::nullopt;
  const auto sections = elf_slice(file, header->e_shoff, std::uint64_t{header->e_shnum} * sizeof(Elf64_Shdr));
  if (!sections) return std::nullopt;
  for (std::uint64_t i = 0; const auto section = elf_item<Elf64_Shdr>(*sections, i); ++i) {
    if (section->sh_type != SHT_SYMTAB) continue;
    const auto symbols = elf_slice(file, section->sh_offset, section->sh_size);
    const auto texts = elf_item<Elf64_Shdr>(*sections, section->sh_link);
    const auto names = texts ? elf_slice(file, texts->sh_offset, texts->sh_size) : std::nullopt;
    if (symbols && names) return function_in(*symbols, *names, address);
  }
  return std::nullopt;
}

// How people call it. A copy in memory has the name of the file that was copied.
std::string file_name(const char* path) {
  std::error_code error;
  const std::filesystem::path given(path);
  if (!given.string().starts_with("/proc/self/fd/")) return given.filename();
  std::string name = std::filesystem::read_symlink(given, error).filename();  // "/memfd:NAME (deleted)"
  constexpr std::string_view kBefore = "memfd:";
  constexpr std::string_view kBehind = " (deleted)";
  if (name.starts_with(kBefore)) name.erase(0, kBefore.size());
  if (name.ends_with(kBehind)) name.resize(name.size() - kBehind.size());
  return name;
}

}  // namespace

const std::vector<char>& SymbolNames::contents_of(const char* path) {
  const auto known = files_.find(std::string_view(path));
  if (known != files_.end()) return known->second;
  // As a whole: byte by byte a large file would keep the control thread for seconds.
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::vector<char> contents(error ? 0 : size);
  std::ifstream file(path, std::ios::binary);
  file.read(contents.data(), std::ssize(contents));
  contents.resize(static_cast<std::size_t>(file.gcount()));
  return files_.emplace(path, std::move(contents)).first->second;
}

std::string SymbolNames::at(std::uintptr_t address, bool returned_to) {
  const std::uintptr_t looked_at = returned_to && address != 0 ? address - 1 : address;
  Dl_info info{};
  // NOLINTNEXTLINE(performance-no-int-to-ptr): it is an address
  if (looked_at == 0 || ::dladdr(reinterpret_cast<const void*>(looked_at), &info) == 0 ||
      info.dli_fname == nullptr)
    return {};
  const std::string file = file_name(info.dli_fname);
  const auto base = reinterpret_cast<std::uintptr_t>(info.dli_fbase);
  const std::uintptr_t behind = address - looked_at;
  if (const auto function =
          function_at(std::as_bytes(std::span(contents_of(info.dli_fname))), looked_at - base)) {
    return printable(fmt::format("{}+{:#x} in {}", function->name, function->offset + behind, file));
  }
  if (info.dli_sname != nullptr) {
    const auto offset = address - reinterpret_cast<std::uintptr_t>(info.dli_saddr);
    return printable(fmt::format("{}+{:#x} in {}", demangled(info.dli_sname), offset, file));
  }
  return printable(fmt::format("{}+{:#x}", file, address - base));
}

std::string with_readable_symbols(std::string_view text) {
  constexpr std::string_view kMangled = "_Z";
  constexpr std::string_view kSymbol = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_$.";
  std::string readable;
  while (!text.empty()) {
    const std::size_t begin = std::min(text.find(kMangled), text.size());
    readable += text.substr(0, begin);
    text.remove_prefix(begin);
    const std::size_t end = std::min(text.find_first_not_of(kSymbol), text.size());
    if (end != 0) readable += demangled(std::string(text.substr(0, end)).c_str());
    text.remove_prefix(end);
  }
  return readable;
}

}  // namespace plchost
