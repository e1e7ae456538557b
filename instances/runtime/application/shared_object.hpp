#pragma once

#include <span>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// A loaded application or component. It stays loaded unless unload() is called. Its code may be on a stack,
/// its statics are destroyed when the process ends, and another program means a fresh process, or an online
/// change.
class SharedObject {
 public:
  SharedObject() noexcept = default;

  /// Checks the file (see check_elf_file) and loads it, which runs its static constructors. Control thread.
  [[nodiscard]] static Result<SharedObject> load(const std::string& path,
                                                 std::span<const std::string_view> symbols);
  /// The same with a copy in memory, so that it can lie beside what was loaded from this path or file before:
  /// the dynamic loader would take it for that. It can be unloaded (see check_elf_can_leave).
  [[nodiscard]] static Result<SharedObject> load_copy(const std::string& path,
                                                      std::span<const std::string_view> symbols);

  /// The address of an exported symbol; null if there is none.
  [[nodiscard]] void* find(const char* symbol) const noexcept;
  /// Whether that is an address in this object's code or data.
  [[nodiscard]] bool contains(const void* address) const noexcept;

  [[nodiscard]] const std::string& path() const noexcept { return path_; }

  /// Runs its static destructors and takes it out of the process, if nothing else keeps it there. No thread
  /// is in its code, and nobody will call it. Control thread.
  void unload() noexcept;

 private:
  SharedObject(void* handle, std::string path, UniqueFd copy = {}) noexcept
      : handle_(handle), path_(std::move(path)), copy_(std::move(copy)) {}
  void* handle_ = nullptr;
  std::string path_;
  UniqueFd copy_;  // its number is in the name by which the dynamic loader knows the object
};

}  // namespace plchost
