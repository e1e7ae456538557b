#include "manager/store/exception_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/files/replace_file.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/exception_history.hpp"

namespace plchost {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kExtension = ".exceptions";
constexpr mode_t kForManager = 0600;

void remove_oldest(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code unknown;
    if (at->path().extension() == kExtension) files.emplace_back(at->last_write_time(unknown), at->path());
  }
  if (files.size() <= kMostExceptionFiles) return;
  std::ranges::sort(files, std::ranges::greater());
  for (std::size_t i = kMostExceptionFiles; i < files.size(); ++i) fs::remove(files[i].second, error);
}

}  // namespace

std::string exceptions_folder(std::string_view state_directory, std::string_view host) {
  return fmt::format("{}/exceptions.{}", state_directory, host);
}

std::string kept_exceptions_path(std::string_view folder, std::string_view instance) {
  return fmt::format("{}/{}{}", folder, instance, kExtension);
}

Result<void> keep_exceptions_on_disk(const std::string& path, const std::string& from) {
  PLCHOST_TRY_ASSIGN(auto found, read_exceptions(from));
  // Without a time each would be a new one, again and again.
  std::erase_if(found.entries, [](const ExceptionEntry& entry) { return entry.unix_ns == 0; });
  if (found.entries.empty()) return {};
  auto kept = read_exceptions(path);
  if (!kept && kept.error().code != ErrorCode::corrupt) return std::unexpected(kept.error());
  const ExceptionHistory before = kept ? *kept : ExceptionHistory{};
  ExceptionHistory now = before;
  now.take(found);
  if (now == before) return {};
  const std::string folder = fs::path(path).parent_path();
  PLCHOST_TRY(make_synced_folders(folder, S_IRWXU));
  PLCHOST_TRY(write_exceptions(path, now, kForManager));
  remove_oldest(folder);
  return sync_directory(folder);
}

// The disk may have answered late: then the instance runs, and what it has written in between stays. Its own
// temporary file is another one.
Result<void> restore_exceptions(const std::string& path, const std::string& to) {
  PLCHOST_TRY_ASSIGN(const auto kept, read_exceptions(path));
  if (kept.entries.empty()) return {};
  const std::string fresh = to + ".kept";
  PLCHOST_TRY(write_exceptions(fresh, kept));
  const bool renamed = ::renameat2(AT_FDCWD, fresh.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0;
  const int error = errno;
  if (renamed) return {};
  ::unlink(fresh.c_str());
  if (error == EEXIST) return {};
  return failure(ErrorCode::system, "cannot rename " + fresh, error);
}

}  // namespace plchost
