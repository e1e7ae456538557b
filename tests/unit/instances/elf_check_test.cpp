#include "instances/runtime/application/elf_check.hpp"

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include <elf.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

using ::testing::HasSubstr;

constexpr std::array<std::string_view, 1> kInit = {"plc_app_init"};

std::vector<std::byte> sample() {
  std::ifstream file(ELF_SAMPLE, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

template <class T>
void put(std::vector<std::byte>& file, std::size_t offset, T value) {
  std::memcpy(file.data() + offset, &value, sizeof value);
}

std::string complaint_about(const std::vector<std::byte>& file) {
  const auto checked = check_elf(file, kInit);
  return checked ? std::string() : checked.error().message;
}

// The first of the functions that it defines becomes one that exists once in a process.
TEST(ElfCheck, FindsWhatExistsOnceInAProcess) {
  auto file = sample();
  EXPECT_TRUE(check_elf_can_leave(file));
  Elf64_Ehdr header{};
  std::memcpy(&header, file.data(), sizeof header);
  bool changed = false;
  for (std::size_t i = 0; i < header.e_shnum; ++i) {
    Elf64_Shdr section{};
    std::memcpy(&section, file.data() + header.e_shoff + i * sizeof section, sizeof section);
    if (section.sh_type != SHT_DYNSYM) continue;
    for (std::size_t at = section.sh_offset; at < section.sh_offset + section.sh_size;
         at += sizeof(Elf64_Sym)) {
      Elf64_Sym symbol{};
      std::memcpy(&symbol, file.data() + at, sizeof symbol);
      if (symbol.st_shndx == SHN_UNDEF || ELF64_ST_TYPE(symbol.st_info) != STT_FUNC) continue;
      symbol.st_info = ELF64_ST_INFO(STB_GNU_UNIQUE, ELF64_ST_TYPE(symbol.st_info));
      put(file, at, symbol);
      changed = true;
      break;
    }
  }
  ASSERT_TRUE(changed);
  const auto refused = check_elf_can_leave(file);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("-fno-gnu-unique"));
  EXPECT_THAT(refused.error().message, HasSubstr("plc_app_"));
}

TEST(ElfCheck, AcceptsAGoodApplication) {
  EXPECT_EQ(complaint_about(sample()), "");
}

TEST(ElfCheck, RefusesTextAndNothing) {
  EXPECT_THAT(complaint_about({}), HasSubstr("is not a shared object"));
  const std::string text = "int main() {}\n";
  const auto bytes = std::as_bytes(std::span(text));
  EXPECT_THAT(complaint_about({bytes.begin(), bytes.end()}), HasSubstr("is not a shared object"));
}

TEST(ElfCheck, RefusesACopyCutShortAnywhere) {
  const auto whole = sample();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    std::vector<std::byte> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    ASSERT_NE(complaint_about(cut), "") << "cut to " << size << " bytes";
  }
}

TEST(ElfCheck, SurvivesAnyByteOfTheHeadersBeingWrong) {
  const auto whole = sample();
  const std::size_t headers = std::min<std::size_t>(whole.size(), 1024);
  for (std::size_t at = 0; at < headers; ++at) {
    for (const unsigned value : {0x00U, 0x7fU, 0x80U, 0xffU}) {
      auto damaged = whole;
      damaged[at] = static_cast<std::byte>(value);
      (void)check_elf(damaged, kInit);  // the sanitizers watch; either answer is right
    }
  }
}

TEST(ElfCheck, NamesTheOtherMachine) {
  auto file = sample();
  put<Elf64_Half>(file, offsetof(Elf64_Ehdr, e_machine), EM_ARM);
  EXPECT_THAT(complaint_about(file), HasSubstr("is built for 32-bit ARM; this machine is"));
  put<Elf64_Half>(file, offsetof(Elf64_Ehdr, e_machine), EM_RISCV);
  EXPECT_THAT(complaint_about(file), HasSubstr("RISC-V"));
}

TEST(ElfCheck, Refuses32BitBigEndianAndOtherTypes) {
  auto narrow = sample();
  narrow[EI_CLASS] = std::byte{ELFCLASS32};
  EXPECT_THAT(complaint_about(narrow), HasSubstr("32 bit"));
  auto big = sample();
  big[EI_DATA] = std::byte{ELFDATA2MSB};
  EXPECT_THAT(complaint_about(big), HasSubstr("big-endian"));
  auto object = sample();
  put<Elf64_Half>(object, offsetof(Elf64_Ehdr, e_type), ET_REL);
  EXPECT_THAT(complaint_about(object), HasSubstr("-shared -fPIC"));
}

TEST(ElfCheck, NamesTheSymbolsThatAreMissing) {
  constexpr std::array<std::string_view, 3> kWanted = {"plc_app_init", "plc_app", "HookFunction"};
  const auto checked = check_elf(sample(), kWanted);
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().message, HasSubstr("does not export plc_app, HookFunction"));
}

TEST(ElfCheck, NamesAFileThatIsNotThere) {
  const auto checked = check_elf_file("/nonexistent/mine.so", kInit);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::not_found);
  EXPECT_THAT(checked.error().message, HasSubstr("/nonexistent/mine.so cannot be opened"));
}

}  // namespace
}  // namespace plchost
