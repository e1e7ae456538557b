#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The files in which a kernel tells about itself, below a root: that of the host, or a folder that a test
/// has made. Every path begins with a slash and is shown in errors as it is on a host.
class HostFiles {
 public:
  explicit HostFiles(std::string root = {}) : root_(std::move(root)) {}

  /// The beginning of a file, without the end of its last line. not_found: it is not there; refused: no
  /// right; corrupt: bytes that are no text.
  [[nodiscard]] Result<std::string> text(const std::string& path) const;
  /// corrupt: does not hold one whole number.
  [[nodiscard]] Result<std::int64_t> number(const std::string& path) const;
  /// corrupt: not of the form "0-3,8". "(null)", as the kernel sometimes writes an empty set, is one.
  [[nodiscard]] Result<std::vector<int>> cores(const std::string& path) const;
  /// Of the form "ff,00000003".
  [[nodiscard]] Result<std::vector<int>> core_mask(const std::string& path) const;
  /// The names in a folder, sorted; those that may be read.
  [[nodiscard]] Result<std::vector<std::string>> names(const std::string& path) const;
  [[nodiscard]] bool exists(const std::string& path) const;
  /// This process may write it. not_found, refused.
  [[nodiscard]] Result<void> writable(const std::string& path) const;
  /// The file is not there, but its folder is: the kernel has nothing of that kind.
  [[nodiscard]] bool kernel_lacks(const std::string& path) const;

  static constexpr std::size_t kMaxText = std::size_t{1} << 16;

 private:
  std::string root_;
};

}  // namespace plchost
