#include "instances/runtime/application/shared_object.hpp"

#include <cerrno>
#include <filesystem>
#include <utility>

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#include "instances/runtime/application/elf_check.hpp"
#include "instances/runtime/application/symbol_name.hpp"
#include "shm/base/names.hpp"
#include "shm/process/dynamic_loader.hpp"

namespace plchost {

namespace {

std::string absolute_of(const std::string& path) {
  std::error_code error;
  return std::filesystem::absolute(path, error);
}

// `file` is where the loader finds it, `path` is what people know it by.
Result<void*> open_program(const std::string& file, const std::string& path) {
  auto opened = open_library(file, RTLD_NOW | RTLD_LOCAL);
  if (!opened) {
    std::string& text = opened.error().message;
    text = fmt::format("{} cannot be loaded: {}", path, printable(with_readable_symbols(text)));
  }
  return opened;
}

// A file without a name that nobody can change any more.
Result<UniqueFd> memory_file(const std::string& name, std::span<const std::byte> bytes) {
  UniqueFd file(::memfd_create(name.c_str(), MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!file) return failure(ErrorCode::system, "cannot create a file in memory", errno);
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return failure(ErrorCode::system, "cannot copy into memory", errno);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  if (::fcntl(file.get(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
    return failure(ErrorCode::system, "cannot seal a file in memory", errno);
  }
  return file;
}

}  // namespace

Result<SharedObject> SharedObject::load(const std::string& path, std::span<const std::string_view> symbols) {
  PLCHOST_TRY(check_elf_file(path, symbols));
  // Without a slash, dlopen would search the system's folders for it.
  const std::string absolute = absolute_of(path);
  PLCHOST_TRY_ASSIGN(const auto handle, open_program(absolute, path));
  return SharedObject(handle, absolute);
}

Result<SharedObject> SharedObject::load_copy(const std::string& path,
                                             std::span<const std::string_view> symbols) {
  const auto fails = [&](Error error) {
    error.message = fmt::format("{} {}", path, error.message);
    return std::unexpected(std::move(error));
  };
  const auto bytes = read_program(path);
  if (!bytes) return fails(bytes.error());
  if (auto checked = check_elf(*bytes, symbols); !checked) return fails(std::move(checked).error());
  if (auto checked = check_elf_can_leave(*bytes); !checked) return fails(std::move(checked).error());
  constexpr std::size_t kMaxName = 200;
  auto copy = memory_file(std::filesystem::path(path).filename().string().substr(0, kMaxName), *bytes);
  if (!copy) return fails(std::move(copy).error());
  PLCHOST_TRY_ASSIGN(const auto handle, open_program(fmt::format("/proc/self/fd/{}", copy->get()), path));
  return SharedObject(handle, absolute_of(path), *std::move(copy));
}

void* SharedObject::find(const char* symbol) const noexcept {
  return handle_ == nullptr ? nullptr : ::dlsym(handle_, symbol);
}

bool SharedObject::contains(const void* address) const noexcept {
  Dl_info info{};
  link_map* map = nullptr;
  if (handle_ == nullptr || ::dlinfo(handle_, RTLD_DI_LINKMAP, static_cast<void*>(&map)) != 0) return false;
  void* of_address = nullptr;
  return ::dladdr1(address, &info, &of_address, RTLD_DL_LINKMAP) != 0 && of_address == map;
}

void SharedObject::unload() noexcept {
  if (handle_ != nullptr) ::dlclose(std::exchange(handle_, nullptr));
  copy_.reset();
}

}  // namespace plchost
