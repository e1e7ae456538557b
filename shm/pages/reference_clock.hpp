#pragma once

#include <string>
#include <string_view>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/plc_reference_clock.h"

namespace plchost {

/// The name of a shared memory of the pool: 1 to kMaxObjectName characters, see check_name.
[[nodiscard]] Result<void> check_reference_name(std::string_view name);

/// The record of shm/plc_reference_clock.h, mapped into this process. Set-up, but for reading and writing it.
/// Strangers can empty its file at any time: in a process with the handlers of install_fault_handlers() it is
/// then all zero, a record into which nothing was written.
class ReferenceClockRecord {
 public:
  /// Opens it, or makes it if it is not there or its file is empty. corrupt: there is something else of that
  /// name, or another version.
  [[nodiscard]] static Result<ReferenceClockRecord> open(std::string_view pool, std::string_view name);
  /// Removes the name; processes that have it mapped keep it.
  static void remove(std::string_view pool, std::string_view name) noexcept;

  [[nodiscard]] plc_reference_clock& record() const noexcept;
  /// Whether it is not what the name leads to any more: removed, made anew by others, cut short or
  /// overwritten. Then it is to be opened again.
  [[nodiscard]] bool gone() const noexcept;

 private:
  struct Identity {
    dev_t device = 0;
    ino_t inode = 0;
    off_t size = 0;
    bool operator==(const Identity&) const = default;
  };
  ReferenceClockRecord(MemoryFile memory, std::string file, Identity identity) noexcept
      : memory_(std::move(memory)), file_(std::move(file)), identity_(identity) {}
  [[nodiscard]] static Identity identity_of(const std::string& file) noexcept;

  MemoryFile memory_;
  std::string file_;
  Identity identity_;
};

}  // namespace plchost
