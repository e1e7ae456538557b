#pragma once

#include <string>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// Held by one manager at a time; the kernel lets go of it however the manager ends.
class LockFile {
 public:
  /// already_exists: another process holds it; the text says which.
  [[nodiscard]] static Result<LockFile> take(const std::string& path);
  /// At an orderly end, still holding the lock.
  void remove() noexcept;

 private:
  LockFile(UniqueFd fd, std::string path) : fd_(std::move(fd)), path_(std::move(path)) {}
  UniqueFd fd_;
  std::string path_;
};

/// Tells the service manager that started us, if there is one ("READY=1", "STOPPING=1").
void notify_service_manager(const char* state) noexcept;

}  // namespace plchost
