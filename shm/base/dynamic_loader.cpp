#include "shm/base/dynamic_loader.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>

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

bool tells_no_cause(std::string_view text) {
  return std::ranges::any_of(kWithoutCause, [&](std::string_view end) { return text.ends_with(end); });
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
  return tells_no_cause(text) ? Cause{.number = ENOMEM} : Cause{};
}

// EPERM and EACCES last: a file system that is mounted noexec, or a rule of the system's administrator.
bool may_run(const std::string& file) {
  const UniqueFd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));  // NOLINT: variadic
  if (!fd) return true;
  void* const mapped = ::mmap(nullptr, 1, PROT_READ | PROT_EXEC, MAP_PRIVATE, fd.get(), 0);
  if (mapped == MAP_FAILED) return errno != EPERM && errno != EACCES;
  ::munmap(mapped, 1);
  return true;
}

}  // namespace

int transient_error_of_loader(std::string_view text) {
  return cause_in(text).number;
}

Result<void*> open_library(const std::string& file, int flags) {
  if (void* const handle = ::dlopen(file.c_str(), flags)) return handle;
  const char* const said = ::dlerror();
  std::string text = said == nullptr ? "dlopen failed" : said;
  const Cause cause = cause_in(text);
  if (cause.number == 0) return failure(ErrorCode::invalid_argument, std::move(text));
  if (tells_no_cause(text) && !may_run(file)) {
    return failure(ErrorCode::refused, text + ": no program may run from there; is it mounted noexec?");
  }
  text.resize(text.size() - cause.length);  // the error's own words follow
  return failure(ErrorCode::system, std::move(text), cause.number);
}

}  // namespace plchost
