#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

#include <elf.h>
#include <sys/mman.h>
#include <unistd.h>

#include "instances/runtime/application/build_of.hpp"
#include "instances/runtime/application/debug_lines.hpp"
#include "instances/runtime/application/elf_functions.hpp"

namespace {

using namespace plchost;

void look_at(std::span<const std::byte> bytes) {
  UniqueFd file(::memfd_create("fuzzed", MFD_CLOEXEC));
  if (::write(file.get(), bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) std::abort();
  const auto elf = ElfFile::of(std::move(file));
  if (!elf) return;
  constexpr std::array<std::uint64_t, 8> kAddresses{0x1000, 0x10, 0x24d, 0x24f, 0x251, 0x253, 0x400, 0x1130};
  const auto lines = source_lines(*elf, kAddresses);
  const auto functions = functions_at(*elf, kAddresses);
  if (lines.size() != kAddresses.size() || functions.size() != kAddresses.size()) std::abort();
  for (const SourceLine& line : lines) {
    if (line.file.find('/') != std::string::npos || (line.line == 0 && !line.file.empty())) std::abort();
  }
  constexpr std::size_t kMostOfAField = 255;
  if (build_of(*elf).size() > kMostOfAField) std::abort();
}

// A file that has nothing but these lines, and the same bytes as its texts: a whole file seldom stays one.
std::vector<std::byte> file_with(std::span<const std::byte> lines) {
  constexpr std::string_view kNames("\0.debug_line\0.debug_line_str\0.debug_str\0.shstrtab", 50);
  constexpr std::array<std::uint32_t, 5> kAt{0, 1, 13, 29, 40};
  std::vector<std::byte> file(sizeof(Elf64_Ehdr) + kAt.size() * sizeof(Elf64_Shdr));
  const std::size_t names_at = file.size();
  const auto names = std::as_bytes(std::span(kNames));
  file.insert(file.end(), names.begin(), names.end());
  const std::size_t lines_at = file.size();
  file.insert(file.end(), lines.begin(), lines.end());
  Elf64_Ehdr header{};
  std::memcpy(header.e_ident, ELFMAG, SELFMAG);
  header.e_ident[EI_CLASS] = ELFCLASS64;
  header.e_shoff = sizeof header;
  header.e_shnum = kAt.size();
  header.e_shstrndx = kAt.size() - 1;
  std::memcpy(file.data(), &header, sizeof header);
  for (std::size_t i = 1; i < kAt.size(); ++i) {
    const bool last = i == kAt.size() - 1;
    Elf64_Shdr section{};
    section.sh_name = kAt.at(i);
    section.sh_type = SHT_PROGBITS;
    section.sh_offset = last ? names_at : lines_at;
    section.sh_size = last ? names.size() : lines.size();
    std::memcpy(&file[sizeof header + i * sizeof section], &section, sizeof section);
  }
  return file;
}

}  // namespace

// The debug information of an application, which a stranger has written: any bytes end in lines, functions
// and a build, or in none.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  look_at(bytes);
  look_at(file_with(bytes));
  return 0;
}
