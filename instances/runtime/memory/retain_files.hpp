#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "instances/runtime/memory/retain_image.hpp"
#include "shm/base/result.hpp"
#include "shm/files/lock_file.hpp"

namespace plchost {

/// The two files of an instance's retain variables, DIRECTORY/INSTANCE.retain.0 and .1. Each generation takes
/// the place of the one before the last, so whenever the power is cut one of them is whole.
class RetainFiles {
 public:
  /// Makes the directory if it is not there (its parent is). busy: another process has these files. If the
  /// disk refuses the lock, write() tries again to get it and says why it does not. Set-up.
  [[nodiscard]] static Result<RetainFiles> open(const std::string& directory, const std::string& instance);

  /// Whether the lock was to be had, by open() or take().
  [[nodiscard]] bool held() const noexcept { return lock_.has_value(); }
  /// Tries again if it was not. write() does, too.
  [[nodiscard]] Result<void> take();

  struct Found {
    std::optional<RetainImage> newest;  ///< of those that are whole
    std::vector<std::string> problems;  ///< files that are there and are not
    std::bitset<2> damaged;             ///< which these are
  };
  [[nodiscard]] Found read() const;
  /// The same without having the files: another process may write them meanwhile.
  [[nodiscard]] static Found look(const std::string& directory, const std::string& instance);

  /// When it returns well, the image is on the disk. Else the files are as they were. Set-up, or a thread
  /// that may wait for a disk.
  [[nodiscard]] Result<void> write(const RetainImage& image);

  /// Puts copies of those files aside, under INSTANCE.retain.0.old and .1.old. They are on the disk when it
  /// returns well. system: which one is not. Set-up, or a thread that may wait for a disk.
  [[nodiscard]] Result<void> put_aside(std::bitset<2> which) const;

 private:
  RetainFiles(std::string stem, std::string directory)
      : stem_(std::move(stem)), directory_(std::move(directory)) {}
  [[nodiscard]] std::string path(std::uint64_t generation) const;

  std::string stem_;
  std::string directory_;
  std::optional<LockFile> lock_;  // none: it was refused
};

}  // namespace plchost
