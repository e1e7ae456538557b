#include "shm/process/dynamic_loader.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <new>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>

#include "shm/base/transient.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

struct Cause {
  int number = 0;
  std::size_t length = 0;  // of its words at the end of the text
};

// glibc gives no cause in these: memory was short, or no program may run from that place.
constexpr std::array<std::string_view, 4> kWithoutCause = {"failed to map segment from shared object",
                                                           "cannot change memory protections",
                                                           "cannot map zero-fill pages", "out of memory"};

/// Nothing: the text tells a cause, or is none of the loader. Empty: it names no library.
std::optional<std::string_view> library_without_cause(std::string_view text) {
  const auto* const words =
      std::ranges::find_if(kWithoutCause, [&](std::string_view end) { return text.ends_with(end); });
  if (words == kWithoutCause.end()) return std::nullopt;
  text.remove_suffix(words->size());
  if (text.ends_with(": ")) text.remove_suffix(2);
  const std::size_t before = text.rfind(": ");
  return before == std::string_view::npos ? text : text.substr(before + 2);
}

Cause cause_in(std::string_view text) {
  constexpr int kLast = EHWPOISON;
  // The file that needs a symbol chooses its name.
  if (text.find("undefined symbol: ") != std::string_view::npos) return {};
  for (int number = 1; number <= kLast; ++number) {
    if (!is_transient({.code = ErrorCode::system, .system_errno = number, .message = {}})) continue;
    // Before a program runs, the loader has words for few numbers.
    for (const std::string& end :
         {fmt::format(": {}", strerrordesc_np(number)), fmt::format(": Error {}", number)}) {
      if (text.ends_with(end)) return {.number = number, .length = end.size()};
    }
  }
  return library_without_cause(text) ? Cause{.number = ENOMEM} : Cause{};
}

// EPERM and EACCES last: a file system that is mounted noexec, or a rule of the system's administrator.
// Nothing: there is no such file.
std::optional<bool> may_run(const std::string& file) {
  const UniqueFd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));  // NOLINT: variadic
  if (!fd) return std::nullopt;
  void* const mapped = ::mmap(nullptr, 1, PROT_READ | PROT_EXEC, MAP_PRIVATE, fd.get(), 0);
  if (mapped == MAP_FAILED) return errno != EPERM && errno != EACCES;
  ::munmap(mapped, 1);
  return true;
}

// The loader takes the first one that it finds.
bool may_run(std::string_view library, std::vector<std::string> folders) {
  if (library.empty()) return true;
  if (library.find('/') != std::string_view::npos) return may_run(std::string(library)).value_or(true);
  std::ranges::move(library_folders(), std::back_inserter(folders));
  for (const std::string& folder : folders) {
    if (const auto may = may_run(fmt::format("{}/{}", folder, library))) return *may;
  }
  return true;
}

}  // namespace

std::vector<std::string> library_folders() {
  std::vector<std::string> folders;
  void* const self = ::dlopen(nullptr, RTLD_LAZY);
  if (self == nullptr) return folders;
  Dl_serinfo size{};
  if (::dlinfo(self, RTLD_DI_SERINFOSIZE, &size) == 0) {
    std::vector<std::max_align_t> memory(size.dls_size / sizeof(std::max_align_t) + 1);
    auto* const found = new (memory.data()) Dl_serinfo(size);
    if (::dlinfo(self, RTLD_DI_SERINFOSIZE, found) == 0 && ::dlinfo(self, RTLD_DI_SERINFO, found) == 0) {
      for (const Dl_serpath& path : std::span(found->dls_serpath, found->dls_cnt)) {
        folders.emplace_back(path.dls_name);
      }
    }
  }
  ::dlclose(self);
  return folders;
}

Error error_of_loader(std::string text, std::vector<std::string> folders) {
  const Cause cause = cause_in(text);
  if (cause.number == 0) return {.code = ErrorCode::invalid_argument, .message = std::move(text)};
  if (const auto library = library_without_cause(text); library && !may_run(*library, std::move(folders))) {
    return {.code = ErrorCode::refused,
            .message = std::move(text) + ": no program may run from there; is it mounted noexec?"};
  }
  text.resize(text.size() - cause.length);  // the error's own words follow
  return {.code = ErrorCode::system, .system_errno = cause.number, .message = std::move(text)};
}

Result<void*> open_library(const std::string& file, int flags) {
  if (void* const handle = ::dlopen(file.c_str(), flags)) return handle;
  const char* const said = ::dlerror();
  return std::unexpected(
      error_of_loader(said == nullptr ? "dlopen failed" : said, {std::filesystem::path(file).parent_path()}));
}

}  // namespace plchost
