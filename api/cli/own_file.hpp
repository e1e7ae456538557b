#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// A file that the user names, which only its owner may read. Until all of it is written, it has another name
/// beside that one, which is gone when this ends early.
class OwnFile {
 public:
  /// wrong_type: there is a link, a folder or a device of that name, which stays as it is. system: no file
  /// can be made there.
  [[nodiscard]] static Result<OwnFile> create(std::string path);
  OwnFile(OwnFile&& other) noexcept
      : path_(std::move(other.path_)), fresh_(std::exchange(other.fresh_, {})), fd_(std::move(other.fd_)) {}
  OwnFile& operator=(OwnFile&&) = delete;
  ~OwnFile();

  [[nodiscard]] Result<void> write(std::string_view bytes);
  /// Gives it its name, in place of a file that had it. All of it is on the disk then.
  [[nodiscard]] Result<void> put_in_place();

 private:
  OwnFile(std::string path, std::string fresh, UniqueFd fd)
      : path_(std::move(path)), fresh_(std::move(fresh)), fd_(std::move(fd)) {}
  std::string path_;
  std::string fresh_;
  UniqueFd fd_;
};

}  // namespace plchost
