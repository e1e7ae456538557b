#include "instances/runtime/application/shared_object.hpp"

#include <filesystem>

#include <dlfcn.h>
#include <fmt/format.h>

#include "instances/runtime/application/elf_check.hpp"

namespace plchost {

Result<SharedObject> SharedObject::load(const std::string& path, std::span<const std::string_view> symbols) {
  if (auto checked = check_elf_file(path, symbols); !checked) return std::unexpected(checked.error());
  // Without a slash, dlopen would search the system's folders for it.
  std::error_code error;
  const std::string absolute = std::filesystem::absolute(path, error);
  void* const handle = ::dlopen(absolute.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    return failure(ErrorCode::invalid_argument, fmt::format("{} cannot be loaded: {}", path, ::dlerror()));
  }
  return SharedObject(handle, absolute);
}

void* SharedObject::find(const char* symbol) const noexcept {
  return handle_ == nullptr ? nullptr : ::dlsym(handle_, symbol);
}

}  // namespace plchost
