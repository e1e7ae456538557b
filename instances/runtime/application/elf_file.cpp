#include "instances/runtime/application/elf_file.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include <elf.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "instances/runtime/application/elf_bytes.hpp"

namespace plchost {

namespace {

constexpr std::uint64_t kMostSections = 4096;
constexpr std::size_t kMostOfAText = std::size_t{16} << 10;

}  // namespace

std::optional<ElfFile> ElfFile::open(const std::string& path) {
  return of(UniqueFd(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)));
}

std::optional<ElfFile> ElfFile::of(UniqueFd opened) {
  struct stat status{};
  if (!opened || ::fstat(opened.get(), &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  ElfFile file(std::move(opened));
  const auto header = elf_item<Elf64_Ehdr>(file.read(0, sizeof(Elf64_Ehdr)), 0);
  if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0 ||
      header->e_ident[EI_CLASS] != ELFCLASS64)
    return std::nullopt;
  const std::uint64_t count = std::min<std::uint64_t>(header->e_shnum, kMostSections);
  const auto table = file.read(header->e_shoff, count * sizeof(Elf64_Shdr));
  std::vector<std::uint32_t> names;
  for (std::uint64_t i = 0; const auto section = elf_item<Elf64_Shdr>(table, i); ++i) {
    names.push_back(section->sh_name);
    file.sections_.push_back(
        {.name = {},
         .type = section->sh_type,
         .link = section->sh_link,
         .offset = section->sh_offset,
         .size = section->sh_size,
         .plain = section->sh_type != SHT_NOBITS && (section->sh_flags & SHF_COMPRESSED) == 0});
  }
  if (const Section* const texts = file.at(header->e_shstrndx)) {
    for (std::size_t i = 0; i < names.size(); ++i) file.sections_[i].name = file.text(*texts, names[i]);
  }
  return file;
}

const ElfFile::Section* ElfFile::find(std::string_view name) const noexcept {
  const auto found = std::ranges::find_if(
      sections_, [name](const Section& section) { return section.plain && section.name == name; });
  return found == sections_.end() ? nullptr : &*found;
}

const ElfFile::Section* ElfFile::find(std::uint32_t type) const noexcept {
  const auto found = std::ranges::find_if(
      sections_, [type](const Section& section) { return section.plain && section.type == type; });
  return found == sections_.end() ? nullptr : &*found;
}

const ElfFile::Section* ElfFile::at(std::uint32_t number) const noexcept {
  return number < sections_.size() && sections_[number].plain ? &sections_[number] : nullptr;
}

std::vector<std::byte> ElfFile::read(const Section& section, std::uint64_t from, std::size_t size) const {
  if (from >= section.size) return {};
  const std::uint64_t begin = section.offset + from;
  if (begin < from) return {};
  return read(begin, std::min<std::uint64_t>(size, section.size - from));
}

// The file may have been cut short since it was opened.
std::vector<std::byte> ElfFile::read(std::uint64_t from, std::uint64_t size) const {
  struct stat status{};
  if (::fstat(file_.get(), &status) != 0) return {};
  const auto end = static_cast<std::uint64_t>(std::max<off_t>(status.st_size, 0));
  if (from >= end) return {};
  std::vector<std::byte> bytes(std::min(size, end - from));
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t more =
        ::pread(file_.get(), &bytes[got], bytes.size() - got, static_cast<off_t>(from + got));
    if (more <= 0) break;
    got += static_cast<std::size_t>(more);
  }
  bytes.resize(got);
  return bytes;
}

std::string ElfFile::text(const Section& section, std::uint64_t from) const {
  // Most are short.
  constexpr std::size_t kFirst = 256;
  for (const std::size_t most : {kFirst, kMostOfAText}) {
    const auto bytes = read(section, from, most);
    const std::string_view text = text_in(bytes);
    if (text.size() < bytes.size() || bytes.size() < most || most == kMostOfAText) return std::string(text);
  }
  return {};
}

}  // namespace plchost
