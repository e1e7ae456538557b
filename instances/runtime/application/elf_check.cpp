#include "instances/runtime/application/elf_check.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <vector>

#include <elf.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "instances/plc_app.h"
#include "instances/runtime/application/elf_bytes.hpp"
#include "shm/base/names.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

#if defined(__x86_64__)
constexpr unsigned kMachine = EM_X86_64;
#elif defined(__aarch64__)
constexpr unsigned kMachine = EM_AARCH64;
#else
#error "say which ELF machine this is"
#endif

constexpr std::string_view kAbiSymbol = "plc_app_abi";

std::string machine_name(unsigned machine) {
  switch (machine) {
    case EM_386:
      return "32-bit x86";
    case EM_X86_64:
      return "x86-64";
    case EM_ARM:
      return "32-bit ARM";
    case EM_AARCH64:
      return "64-bit ARM";
    case EM_PPC:
      return "PowerPC";
    case EM_RISCV:
      return "RISC-V";
    default:
      return fmt::format("ELF machine {}", machine);
  }
}

std::unexpected<Error> invalid_program(std::string text) {
  return failure(ErrorCode::invalid_argument, std::move(text));
}

std::unexpected<Error> truncated(std::string_view part) {
  return invalid_program(
      fmt::format("is cut short or damaged: its {} lie beyond its end; copy it again", part));
}

Result<Elf64_Ehdr> check_header(ElfBytes file) {
  if (file.size() < SELFMAG || std::memcmp(file.data(), ELFMAG, SELFMAG) != 0) {
    return invalid_program("is not a shared object (no ELF file at all)");
  }
  if (file.size() < EI_NIDENT) return truncated("first bytes");
  if (std::to_integer<unsigned>(file[EI_CLASS]) != ELFCLASS64) {
    return invalid_program("is built for 32 bit; this runtime needs 64 bit");
  }
  if (std::to_integer<unsigned>(file[EI_DATA]) != ELFDATA2LSB) {
    return invalid_program("is built for a big-endian machine");
  }
  const auto header = elf_item<Elf64_Ehdr>(file, 0);
  if (!header) return truncated("first bytes");
  if (header->e_machine != kMachine) {
    return invalid_program(fmt::format("is built for {}; this machine is {}", machine_name(header->e_machine),
                                       machine_name(kMachine)));
  }
  if (header->e_type != ET_DYN) {
    return invalid_program("is not a shared object: build it with -shared -fPIC");
  }
  return *header;
}

struct Tables {
  ElfBytes segments;
  ElfBytes sections;
};

Result<Tables> find_tables(ElfBytes file, const Elf64_Ehdr& header) {
  if (header.e_phentsize != sizeof(Elf64_Phdr) || header.e_phnum == 0) {
    return invalid_program("has no program headers: not a shared object that can be loaded");
  }
  const auto segments = elf_slice(file, header.e_phoff, std::uint64_t{header.e_phnum} * sizeof(Elf64_Phdr));
  if (!segments) return truncated("program headers");
  for (std::uint64_t i = 0; const auto segment = elf_item<Elf64_Phdr>(*segments, i); ++i) {
    if (segment->p_type == PT_LOAD && !elf_slice(file, segment->p_offset, segment->p_filesz)) {
      return truncated("segments");
    }
  }
  if (header.e_shnum == 0 || header.e_shentsize != sizeof(Elf64_Shdr)) {
    return invalid_program("has no section headers, so its symbols cannot be checked: do not strip them");
  }
  const auto sections = elf_slice(file, header.e_shoff, std::uint64_t{header.e_shnum} * sizeof(Elf64_Shdr));
  if (!sections) return truncated("section headers");
  return Tables{*segments, *sections};
}

struct Symbols {
  ElfBytes entries;
  ElfBytes names;
};

Result<Symbols> find_symbols(ElfBytes file, ElfBytes sections) {
  for (std::uint64_t i = 0; const auto section = elf_item<Elf64_Shdr>(sections, i); ++i) {
    if (section->sh_type != SHT_DYNSYM) continue;
    const auto entries = elf_slice(file, section->sh_offset, section->sh_size);
    const auto names = elf_item<Elf64_Shdr>(sections, section->sh_link);
    const auto texts = names ? elf_slice(file, names->sh_offset, names->sh_size) : std::nullopt;
    if (!entries || !texts) return truncated("symbols");
    return Symbols{*entries, *texts};
  }
  return invalid_program("exports no symbols at all");
}

std::optional<Elf64_Sym> find_export(const Symbols& symbols, std::string_view wanted) {
  for (std::uint64_t i = 0; const auto symbol = elf_item<Elf64_Sym>(symbols.entries, i); ++i) {
    if (symbol->st_shndx == SHN_UNDEF) continue;
    const auto name = elf_slice(symbols.names, symbol->st_name, wanted.size() + 1);
    if (name && std::memcmp(name->data(), wanted.data(), wanted.size()) == 0 &&
        name->back() == std::byte{0}) {
      return symbol;
    }
  }
  return std::nullopt;
}

// The version that plc_app_abi will have once it is loaded; nothing if it lies in no part of the file.
std::optional<unsigned> read_version(ElfBytes file, ElfBytes segments, const Elf64_Sym& symbol) {
  for (std::uint64_t i = 0; const auto segment = elf_item<Elf64_Phdr>(segments, i); ++i) {
    if (segment->p_type != PT_LOAD || symbol.st_value < segment->p_vaddr) continue;
    const std::uint64_t inside = symbol.st_value - segment->p_vaddr;
    if (segment->p_filesz < sizeof(unsigned) || inside > segment->p_filesz - sizeof(unsigned)) continue;
    const auto bytes = elf_slice(file, segment->p_offset, segment->p_filesz);
    return bytes ? elf_item<unsigned>(bytes->subspan(inside), 0) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

Result<void> check_elf(ElfBytes file, std::span<const std::string_view> symbols) {
  PLCHOST_TRY_ASSIGN(const auto header, check_header(file));
  PLCHOST_TRY_ASSIGN(const auto tables, find_tables(file, header));
  PLCHOST_TRY_ASSIGN(const auto exported, find_symbols(file, tables.sections));

  std::vector<std::string_view> missing;
  std::ranges::copy_if(symbols, std::back_inserter(missing),
                       [&](std::string_view symbol) { return !find_export(exported, symbol); });
  const auto version_symbol = find_export(exported, kAbiSymbol);
  if (!version_symbol) missing.push_back(kAbiSymbol);
  if (!missing.empty() || !version_symbol) {
    return invalid_program(fmt::format("does not export {}; see plc_app.h", join_names(missing)));
  }
  const auto version = read_version(file, tables.segments, *version_symbol);
  if (!version || *version != PLC_APP_ABI_VERSION) {
    return failure(ErrorCode::unsupported,
                   fmt::format("is built against version {} of plc_app.h; this runtime has version {}: build "
                               "it again",
                               version.value_or(0), PLC_APP_ABI_VERSION));
  }
  return {};
}

Result<bool> is_debug_build(ElfBytes file) {
  constexpr std::string_view kImport("plc_debug_declare_pou\0", 22);
  PLCHOST_TRY_ASSIGN(const auto header, check_header(file));
  PLCHOST_TRY_ASSIGN(const auto tables, find_tables(file, header));
  PLCHOST_TRY_ASSIGN(const auto symbols, find_symbols(file, tables.sections));
  for (std::uint64_t i = 0; const auto symbol = elf_item<Elf64_Sym>(symbols.entries, i); ++i) {
    if (symbol->st_shndx != SHN_UNDEF) continue;
    const auto name = elf_slice(symbols.names, symbol->st_name, kImport.size());
    if (name && std::memcmp(name->data(), kImport.data(), kImport.size()) == 0) return true;
  }
  return false;
}

Result<std::vector<std::byte>> read_program(const std::string& path) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!fd) {
    const int error = errno;
    return failure(error == ENOENT ? ErrorCode::not_found : ErrorCode::refused, "cannot be opened", error);
  }
  struct stat status{};
  if (::fstat(fd.get(), &status) != 0) return failure(ErrorCode::system, "cannot be examined", errno);
  if (!S_ISREG(status.st_mode)) return invalid_program("is not a file");
  if (static_cast<std::uint64_t>(status.st_size) > kMaxProgramFile) {
    return invalid_program(fmt::format("is larger than {} bytes", kMaxProgramFile));
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size));
  std::size_t filled = 0;
  while (filled < bytes.size()) {
    const ssize_t got = ::read(fd.get(), bytes.data() + filled, bytes.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failure(ErrorCode::system, "cannot be read", errno);
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
  }
  bytes.resize(filled);
  return bytes;
}

Result<void> check_elf_can_leave(ElfBytes file) {
  PLCHOST_TRY_ASSIGN(const auto header, check_header(file));
  PLCHOST_TRY_ASSIGN(const auto tables, find_tables(file, header));
  PLCHOST_TRY_ASSIGN(const auto exported, find_symbols(file, tables.sections));
  for (std::uint64_t i = 0; const auto symbol = elf_item<Elf64_Sym>(exported.entries, i); ++i) {
    if (symbol->st_shndx == SHN_UNDEF || ELF64_ST_BIND(symbol->st_info) != STB_GNU_UNIQUE) continue;
    const ElfBytes rest =
        exported.names.subspan(std::min<std::size_t>(symbol->st_name, exported.names.size()));
    return failure(ErrorCode::unsupported,
                   fmt::format("has symbols that exist once in a process ('{}'), so that it would share them "
                               "with the version that runs: build it with -fno-gnu-unique",
                               shown(text_in(rest))));
  }
  return {};
}

Result<void> check_elf_file(const std::string& path, std::span<const std::string_view> symbols) {
  auto checked = and_then(read_program(path), [&](const auto& bytes) { return check_elf(bytes, symbols); });
  if (!checked) checked.error().message = fmt::format("{} {}", path, checked.error().message);
  return checked;
}

}  // namespace plchost
