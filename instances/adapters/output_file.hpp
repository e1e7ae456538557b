#pragma once

#include <string>
#include <utility>

#include "shm/base/result.hpp"

namespace plchost {

/// A new version of a file. It waits beside the old one, under a name of its own, until it takes its place.
/// If it is not kept in the end, all is as it was before.
class OutputFile {
 public:
  /// Copies the file `from` beside `to`. Refuses a `to` that is a folder or a device.
  [[nodiscard]] static Result<OutputFile> make(const std::string& from, const std::string& to);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  /// Takes the place of the old version, which is put aside. A reader sees the one or the other. Once.
  [[nodiscard]] Result<void> publish();
  /// The new version stays, and the old one is removed. After publish().
  void keep() noexcept;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  OutputFile(std::string path, std::string fresh) : path_(std::move(path)), fresh_(std::move(fresh)) {}

  std::string path_;
  std::string fresh_;  ///< name of the new version before it is published; empty: it is
  std::string old_;    ///< name of the old version after that; empty: there was none
};

/// Why `path` can be no output; empty: it can. Makes and removes a file beside it.
[[nodiscard]] std::string why_no_output(const std::string& path);

}  // namespace plchost
