#include "instances/runtime/application/symbol_name.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <cxxabi.h>
#include <dlfcn.h>
#include <fmt/format.h>

#include "instances/runtime/application/debug_lines.hpp"
#include "instances/runtime/application/elf_file.hpp"
#include "instances/runtime/application/elf_functions.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

std::string demangled(const char* name) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> readable(
      abi::__cxa_demangle(name, nullptr, nullptr, &status), &std::free);
  return readable ? std::string(readable.get()) : std::string(name);
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

/// A place in the code, and the file that it lies in.
struct Mapped {
  std::string path;  // as the loader has it; empty: none is mapped there
  std::uint64_t behind = 0;
  std::uint64_t looked_at = 0;  // as the file counts addresses
  std::string exported;         // the function as the loader knows it, with its offset; empty: it knows none
};

// A call returns to what may be the next function, so that is looked for before.
Mapped mapped_at(const CodePlace& place) {
  const std::uintptr_t looked_at =
      place.returned_to && place.address != 0 ? place.address - 1 : place.address;
  Dl_info info{};
  // NOLINTNEXTLINE(performance-no-int-to-ptr): it is an address
  if (looked_at == 0 || ::dladdr(reinterpret_cast<const void*>(looked_at), &info) == 0 ||
      info.dli_fname == nullptr)
    return {};
  Mapped mapped{.path = info.dli_fname,
                .behind = place.address - looked_at,
                .looked_at = looked_at - reinterpret_cast<std::uintptr_t>(info.dli_fbase),
                .exported = {}};
  if (info.dli_sname != nullptr) {
    const auto offset = place.address - reinterpret_cast<std::uintptr_t>(info.dli_saddr);
    mapped.exported = fmt::format("{}+{:#x}", demangled(info.dli_sname), offset);
  }
  return mapped;
}

std::string name_in(const std::string& file, const Mapped& place, const std::optional<ElfFunction>& function,
                    const SourceLine& line) {
  std::string name;
  if (function) {
    name = fmt::format("{}+{:#x} in {}", demangled(function->name.c_str()), function->offset + place.behind,
                       file);
  } else if (!place.exported.empty()) {
    name = fmt::format("{} in {}", place.exported, file);
  } else {
    name = fmt::format("{}+{:#x}", file, place.looked_at + place.behind);
  }
  if (line.line != 0 && !line.file.empty()) name += fmt::format(" at {}:{}", line.file, line.line);
  return printable(std::move(name));
}

// Of the places in one file, each with its number among all.
std::vector<std::pair<std::size_t, std::string>> names_in(const std::string& path,
                                                          std::span<const Mapped> mapped,
                                                          std::span<const std::size_t> of_file,
                                                          TimePoint deadline) {
  std::vector<std::uint64_t> addresses;
  for (const std::size_t place : of_file) addresses.push_back(mapped[place].looked_at);
  std::vector<std::optional<ElfFunction>> functions(of_file.size());
  std::vector<SourceLine> lines(of_file.size());
  const bool in_time = MonotonicClock::now() < deadline;
  if (const auto file = in_time ? ElfFile::open(path) : std::nullopt) {
    functions = functions_at(*file, addresses);
    lines = source_lines(*file, addresses, deadline);
  }
  std::vector<std::pair<std::size_t, std::string>> names;
  const std::string shown_file = file_name(path.c_str());
  for (std::size_t i = 0; i < of_file.size(); ++i) {
    names.emplace_back(of_file[i], name_in(shown_file, mapped[of_file[i]], functions[i], lines[i]));
  }
  return names;
}

}  // namespace

std::vector<std::string> names_of(std::span<const CodePlace> places, TimePoint deadline) {
  std::vector<Mapped> mapped;
  std::map<std::string, std::vector<std::size_t>> files;
  for (const CodePlace& place : places) {
    mapped.push_back(mapped_at(place));
    if (!mapped.back().path.empty()) files[mapped.back().path].push_back(mapped.size() - 1);
  }
  std::vector<std::string> names(places.size());
  for (const auto& [path, of_file] : files) {
    for (auto& [place, name] : names_in(path, mapped, of_file, deadline)) names[place] = std::move(name);
  }
  return names;
}

std::string name_of(std::uintptr_t address) {
  const CodePlace place{.address = address};
  return names_of(std::span(&place, 1)).front();
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
