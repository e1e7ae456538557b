#include "instances/adapters/output_file.hpp"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include "instances/adapters/text_files.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxApplication = std::size_t{1} << 30;
constexpr int kAttempts = 100;

/// A name beside `path` that others can only guess, and that does no harm if they do.
std::string name_beside(const std::string& path, int attempt) {
  if (path.empty()) return "-o names no file";
  const fs::path file(path);
  return file.parent_path() / fmt::format(".{}.{}-{}", file.filename().string(), ::getpid(), attempt);
}

/// Writes a new file beside `path`; tells its name.
Result<std::string> write_beside(const std::string& path, std::string_view text) {
  for (int attempt = 0;; ++attempt) {
    std::string fresh = name_beside(path, attempt);
    const auto written = write_new_file(fresh, text);
    if (written) return fresh;
    if (written.error().code != ErrorCode::already_exists || attempt == kAttempts)
      return std::unexpected(written.error());
  }
}

/// A second name of the file, or a copy where the file system has no links. Empty: there is no such file.
Result<std::string> put_aside(const std::string& path) {
  for (int attempt = 0;; ++attempt) {
    std::string aside = name_beside(path, attempt);
    if (::link(path.c_str(), aside.c_str()) == 0) return aside;
    if (errno == ENOENT) return "";
    if (errno == EEXIST && attempt < kAttempts) continue;
    PLCHOST_TRY_ASSIGN(const TextFile old, read_text_file(path, kMaxApplication));
    PLCHOST_TRY(write_new_file(aside, old.text));
    return aside;
  }
}

}  // namespace

std::string why_no_output(const std::string& path) {
  std::error_code error;
  const fs::path file(path);
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error))
    return fmt::format("{}: there is no folder {}; make it first", path, folder.string());
  const fs::file_status status = fs::status(file, error);
  if (!file.has_filename() || fs::is_directory(status))
    return fmt::format("{} is a folder; name a file in it", path);
  if (fs::exists(status) && !fs::is_regular_file(status))
    return fmt::format("{} is not a plain file; name another one", path);
  // Rights do not tell it of each file system, nor to each user.
  const auto fresh = write_beside(path, "");
  if (!fresh) {
    return fmt::format("{}: no file can be made in the folder {}: {}; name another one", path,
                       folder.string(), std::generic_category().message(fresh.error().system_errno));
  }
  ::unlink(fresh->c_str());
  return "";
}

Result<OutputFile> OutputFile::make(const std::string& from, const std::string& to) {
  if (std::string why = why_no_output(to); !why.empty())
    return failure(ErrorCode::wrong_type, std::move(why));
  PLCHOST_TRY_ASSIGN(const TextFile made, read_text_file(from, kMaxApplication));
  PLCHOST_TRY_ASSIGN(auto fresh, write_beside(to, made.text));
  return OutputFile(to, std::move(fresh));
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::exchange(other.path_, {})),
      fresh_(std::exchange(other.fresh_, {})),
      old_(std::exchange(other.old_, {})) {}

OutputFile::~OutputFile() {
  if (path_.empty()) return;
  if (!fresh_.empty()) {
    ::unlink(fresh_.c_str());
  } else if (old_.empty()) {
    ::unlink(path_.c_str());
  } else {
    (void)std::rename(old_.c_str(), path_.c_str());
  }
}

Result<void> OutputFile::publish() {
  PLCHOST_TRY_ASSIGN(old_, put_aside(path_));
  if (std::rename(fresh_.c_str(), path_.c_str()) != 0) {
    const int error = errno;
    if (!old_.empty()) ::unlink(std::exchange(old_, {}).c_str());
    return failure(ErrorCode::system, fmt::format("{} cannot be written", path_), error);
  }
  fresh_.clear();
  return {};
}

void OutputFile::keep() noexcept {
  if (!old_.empty()) ::unlink(old_.c_str());
  path_.clear();
}

}  // namespace plchost
