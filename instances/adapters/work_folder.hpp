#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "shm/base/result.hpp"

namespace plchost {

/// The folder for the files between a program and its application.
class WorkFolder {
 public:
  /// In the folder for temporary files. It goes with the object.
  [[nodiscard]] static Result<WorkFolder> make_temporary();
  /// One that the user names, and that stays: a new one, an empty one, or one of an earlier build, whose
  /// files are removed. A marker in it lists them. wrong_state: it has files that no build has left.
  [[nodiscard]] static Result<WorkFolder> make_kept(const std::string& path);
  /// Whether make_kept() has made it once.
  [[nodiscard]] static bool is_kept(const std::filesystem::path& folder);
  WorkFolder(WorkFolder&& other) noexcept : path_(std::exchange(other.path_, {})), kept_(other.kept_) {}
  WorkFolder& operator=(WorkFolder&&) = delete;
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  ~WorkFolder();

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] Result<void> write(const std::string& name, std::string_view text) const;
  /// In the place of a file that a compiler has written there.
  [[nodiscard]] Result<void> replace(const std::string& name, std::string_view text) const;
  [[nodiscard]] Result<std::string> read(const std::string& name) const;
  /// A compiler may say nothing of a full disk. So this tries to write there.
  [[nodiscard]] Result<void> check_room() const;

 private:
  WorkFolder(std::filesystem::path path, bool kept) : path_(std::move(path)), kept_(kept) {}
  [[nodiscard]] Result<void> mark() const;

  std::filesystem::path path_;  ///< absolute
  bool kept_;
};

}  // namespace plchost
