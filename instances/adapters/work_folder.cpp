#include "instances/adapters/work_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "instances/adapters/text_files.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBetween = std::size_t{256} << 20;
constexpr std::size_t kRoom = std::size_t{256} << 10;
constexpr const char* kMarker = ".plchost-build";
constexpr std::string_view kMarkerHead =
    "# plcctl build application --keep has left these files. Its next run in this folder removes them.\n";

/// The files in a folder, but for the marker. Folders have a '/' behind their names.
Result<std::set<std::string>> names_in(const fs::path& folder) {
  std::error_code error;
  std::set<std::string> names;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code ignored;
    const bool is_folder = it->symlink_status(ignored).type() == fs::file_type::directory;
    names.insert(it->path().filename().string() + (is_folder ? "/" : ""));
  }
  if (error)
    return failure(ErrorCode::system, fmt::format("the folder {} cannot be read", folder.string()),
                   error.value());
  names.erase(kMarker);
  return names;
}

/// Of the build that has left it.
std::set<std::string> names_of_marker(const fs::path& folder) {
  const auto marker = read_text_file(folder / kMarker, kMaxBetween);
  std::set<std::string> names;
  if (!marker || !marker->text.starts_with(kMarkerHead)) return names;
  std::istringstream lines(marker->text.substr(kMarkerHead.size()));
  for (std::string line; std::getline(lines, line);) names.insert(line);
  return names;
}

}  // namespace

Result<WorkFolder> WorkFolder::make_temporary() {
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  if (error) {
    return failure(ErrorCode::system, "TMPDIR names no folder for temporary files", error.value());
  }
  std::string pattern = fs::absolute(folder) / "plchost-build.XXXXXX";
  if (::mkdtemp(pattern.data()) == nullptr) {
    const int reason = errno;
    return failure(
        ErrorCode::system,
        fmt::format("no folder can be made in {}; choose another place by TMPDIR or --keep", folder.string()),
        reason);
  }
  return WorkFolder(pattern, false);
}

Result<WorkFolder> WorkFolder::make_kept(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) return failure(ErrorCode::system, fmt::format("--keep {}: cannot be made", path), error.value());
  WorkFolder folder(fs::absolute(path, error), true);
  PLCHOST_TRY_ASSIGN(const auto present, names_in(folder.path_));
  const auto left = names_of_marker(folder.path_);
  for (const std::string& name : present) {
    if (left.contains(name)) continue;
    folder.path_.clear();
    return failure(
        ErrorCode::wrong_state,
        fmt::format("--keep {}: {} is not of an earlier build; name a new or an empty folder", path, name));
  }
  for (const std::string& name : present) {
    fs::remove(folder.path_ / name, error);
    if (error)
      return failure(ErrorCode::system, fmt::format("cannot remove {}/{}", path, name), error.value());
  }
  PLCHOST_TRY(folder.mark());
  return folder;
}

bool WorkFolder::is_kept(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / kMarker, error);
}

WorkFolder::~WorkFolder() {
  if (path_.empty()) return;
  std::error_code error;
  if (kept_) {
    (void)mark();
  } else {
    fs::remove_all(path_, error);
  }
}

Result<void> WorkFolder::write(const std::string& name, std::string_view text) const {
  return write_new_file(path_ / name, text);
}

Result<void> WorkFolder::replace(const std::string& name, std::string_view text) const {
  std::error_code error;
  fs::remove(path_ / name, error);
  return write(name, text);
}

Result<std::string> WorkFolder::read(const std::string& name) const {
  PLCHOST_TRY_ASSIGN(TextFile file, read_text_file(path_ / name, kMaxBetween));
  return std::move(file.text);
}

Result<void> WorkFolder::check_room() const {
  const std::string probe = ".room";
  PLCHOST_TRY(write(probe, std::string(kRoom, ' ')));
  std::error_code error;
  fs::remove(path_ / probe, error);
  return {};
}

Result<void> WorkFolder::mark() const {
  PLCHOST_TRY_ASSIGN(const auto names, names_in(path_));
  std::error_code error;
  fs::remove(path_ / kMarker, error);
  return write_new_file(path_ / kMarker, fmt::format("{}{}\n", kMarkerHead, fmt::join(names, "\n")));
}

}  // namespace plchost
