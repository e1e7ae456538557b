#pragma once

#include <span>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// A loaded application or component. It is never unloaded: its code may be on a stack, its statics are
/// destroyed when the process ends, and another program always means a fresh process.
class SharedObject {
 public:
  SharedObject() noexcept = default;

  /// Checks the file (see check_elf_file) and loads it, which runs its static constructors. Control thread.
  [[nodiscard]] static Result<SharedObject> load(const std::string& path,
                                                 std::span<const std::string_view> symbols);

  /// The address of an exported symbol; null if there is none.
  [[nodiscard]] void* find(const char* symbol) const noexcept;

  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  SharedObject(void* handle, std::string path) noexcept : handle_(handle), path_(std::move(path)) {}
  void* handle_ = nullptr;
  std::string path_;
};

}  // namespace plchost
