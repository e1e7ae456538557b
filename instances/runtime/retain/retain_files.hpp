#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "instances/runtime/retain/retain_image.hpp"
#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// The two files of an instance's kept variables, DIRECTORY/INSTANCE.retain.0 and .1: each generation takes
/// the place of the one before the last, so whenever the power is cut one of them is whole.
class RetainFiles {
 public:
  /// Makes the directory if it is not there (its parent is). busy: another process has these files. Set-up.
  [[nodiscard]] static Result<RetainFiles> open(const std::string& directory, const std::string& instance);

  struct Found {
    std::optional<RetainImage> newest;  ///< of those that are whole
    std::vector<std::string> problems;  ///< files that are there and are not
  };
  [[nodiscard]] Found read() const;

  /// When it returns well, the image is on the disk. Set-up, or a thread that may wait for a disk.
  [[nodiscard]] Result<void> write(const RetainImage& image) const;

  /// Puts what there is aside, under INSTANCE.retain.0.old and .1.old. Set-up.
  void put_aside() const;

 private:
  RetainFiles(std::string stem, std::string directory, UniqueFd lock)
      : stem_(std::move(stem)), directory_(std::move(directory)), lock_(std::move(lock)) {}
  [[nodiscard]] std::string path(std::uint64_t generation) const;

  std::string stem_;
  std::string directory_;
  UniqueFd lock_;
};

}  // namespace plchost
