#include "manager/store/store_application.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "api/control/application_versions.hpp"
#include "api/security/sha256.hpp"
#include "manager/system/application_trial.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/process/end_with_parent.hpp"

namespace plchost {

namespace {

constexpr std::string_view kUnfinished = ".part";

// The API server reads descriptions, by the group where it has a user of its own. The folder of the host says
// so.
bool group_reads(const std::filesystem::path& folder) {
  std::error_code error;
  const auto rights = std::filesystem::status(folder, error).permissions();
  return !error && (rights & std::filesystem::perms::group_read) != std::filesystem::perms::none;
}

mode_t file_mode(const StoreOrder& order) {
  return group_reads(order.folder) ? 0640 : 0600;
}

Result<void> make_folder(const std::string& folder) {
  const std::filesystem::path of_the_host = std::filesystem::path(folder).parent_path();
  PLCHOST_TRY(make_synced_folders(of_the_host, S_IRWXU));
  return make_synced_folder(folder, group_reads(of_the_host) ? S_IRWXU | S_IRGRP | S_IXGRP : S_IRWXU);
}

// The left-overs of a helper that did not come to its end.
void remove_unfinished(const std::string& folder, const std::set<std::string>& used) {
  const ApplicationVersions versions = read_versions(folder);
  std::vector<std::filesystem::path> unfinished;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string path = at->path().string();
    const bool version =
        std::ranges::find(versions.kept, path, &ApplicationVersion::path) != versions.kept.end();
    const bool half = path.ends_with(kUnfinished) || (path.ends_with(".so") && !version);
    if (half && !used.contains(path)) unfinished.push_back(at->path());
  }
  for (const auto& path : unfinished) std::filesystem::remove(path, error);
}

Result<void> write_fully(int fd, std::span<const std::byte> bytes, const std::string& path) {
  while (!bytes.empty()) {
    PLCHOST_TRY_ASSIGN(const auto written,
                       check_errno(::write(fd, bytes.data(), bytes.size()), "cannot write " + path));
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> copy_checked(const StoreOrder& order, int from, int to, const std::string& path) {
  Sha256 hash;
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  for (std::uint64_t left = order.size; left > 0;) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(left, buffer.size()));
    PLCHOST_TRY_ASSIGN(const auto got,
                       check_errno(::read(from, buffer.data(), wanted), "cannot read " + order.source));
    if (got == 0) {
      return failure(ErrorCode::corrupt, fmt::format("only {} of {} bytes of {} have come", order.size - left,
                                                     order.size, order.name));
    }
    const auto bytes = std::span<const std::byte>(buffer).first(static_cast<std::size_t>(got));
    hash.add(bytes);
    if (auto written = write_fully(to, bytes, path); !written) return written;
    left -= bytes.size();
  }
  const std::string digest = hash.digest();
  if (digest == order.digest) return {};
  return failure(ErrorCode::corrupt, fmt::format("the copy of {} has the SHA-256 {} where {} was announced",
                                                 order.name, digest, order.digest));
}

Result<void> copy_file(const StoreOrder& order, const std::string& path) {
  const UniqueFd from(::open(order.source.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (!from) return failure(ErrorCode::system, "cannot open " + order.source, errno);
  struct stat status{};
  PLCHOST_TRY(check_errno(::fstat(from.get(), &status), "cannot examine " + order.source));
  if (!S_ISREG(status.st_mode)) return failure(ErrorCode::wrong_type, order.source + " is no plain file");
  const UniqueFd to(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, file_mode(order)));
  if (!to) return failure(ErrorCode::system, "cannot open " + path, errno);
  if (auto copied = copy_checked(order, from.get(), to.get(), path); !copied) return copied;
  PLCHOST_TRY(check_errno(::fsync(to.get()), "cannot sync " + path));
  return {};
}

/// In place, for good, but not a version before it has its description.
Result<void> put_in_place(const StoreOrder& order, const std::string& path) {
  const std::string fresh = path + std::string(kUnfinished);
  std::error_code error;
  auto done = copy_file(order, fresh);
  if (done) {
    std::filesystem::rename(fresh, path, error);
    if (error) done = failure(ErrorCode::system, "cannot rename " + fresh, error.value());
  }
  if (done) done = sync_directory(order.folder);
  if (!done) std::filesystem::remove(fresh, error);
  return done;
}

// The trial knows the file by the name of its copy, which its sender does not know.
std::string in_senders_words(std::string text, const std::string& path, const std::string& name) {
  for (std::size_t at = text.find(path); at != std::string::npos; at = text.find(path, at + name.size())) {
    text.replace(at, path.size(), name);
  }
  return text;
}

Result<void> try_application(const StoreOrder& order, const std::string& path) {
  PLCHOST_TRY_ASSIGN(auto trial, ApplicationTrial::start(order.trial, path, order.trial_group));
  trial.await_end();
  const auto valid = trial.verdict();
  if (valid) return {};
  return failure(valid.error().code, fmt::format("{} is refused: {}", order.name,
                                                 in_senders_words(valid.error().message, path, order.name)));
}

Result<void> describe_version(const StoreOrder& order, const std::string& path) {
  const ApplicationVersion version{.number = 0,
                                   .path = {},
                                   .name = order.name,
                                   .digest = order.digest,
                                   .size = order.size,
                                   .stored_unix_ns = unix_time_ns(),
                                   .by = order.by,
                                   .from = order.from,
                                   .before = order.before};
  if (auto written = replace_file(description_path(path), encode(version), file_mode(order)); !written)
    return written;
  return sync_directory(order.folder);
}

// The description first: a file without one is no version, and is removed by the next helper.
void remove_oldest(const StoreOrder& order, const std::set<std::string>& used) {
  const ApplicationVersions versions = read_versions(order.folder);
  std::size_t count = versions.kept.size();
  std::error_code error;
  for (const ApplicationVersion& version : versions.kept) {
    if (count <= order.keep) break;
    if (used.contains(version.path)) continue;
    std::filesystem::remove(description_path(version.path), error);
    std::filesystem::remove(version.path, error);
    --count;
  }
  (void)sync_directory(order.folder);  // else a power cut brings them back, which only takes room
}

Result<std::string> keep_file(const StoreOrder& order) {
  PLCHOST_TRY(make_folder(order.folder));
  const ApplicationVersions versions = read_versions(order.folder);
  std::set<std::string> used{order.before, order.earlier, versions.boot};
  remove_unfinished(order.folder, used);
  const auto loaded = version_at(order.folder, order.before);
  const std::uint32_t number = versions.kept.empty() ? 1 : versions.kept.back().number + 1;
  std::string path = version_path(order.folder, number);
  if (path.size() > kMaxPath) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{}: {} characters; allowed are up to {}: a shorter [host] state_directory is "
                               "needed",
                               path, path.size(), kMaxPath));
  }
  PLCHOST_TRY(put_in_place(order, path));
  std::error_code error;
  if (auto good = try_application(order, path); !good) {
    std::filesystem::remove(path, error);
    return std::unexpected(good.error());
  }
  if (loaded && loaded->digest == order.digest) {  // not once more: it would push out an older one
    std::filesystem::remove(path, error);
    return loaded->path;
  }
  if (auto described = describe_version(order, path); !described) {
    std::filesystem::remove(path, error);
    return std::unexpected(described.error());
  }
  used.insert(path);
  remove_oldest(order, used);
  return path;
}

Result<std::string> set_boot(const StoreOrder& order) {
  PLCHOST_TRY(make_folder(order.folder));
  if (order.boot == order.configured) {
    std::error_code error;
    std::filesystem::remove(boot_path(order.folder), error);
    if (error) return failure(ErrorCode::system, "cannot remove " + boot_path(order.folder), error.value());
  } else {
    PLCHOST_TRY(replace_file(boot_path(order.folder), order.boot, file_mode(order)));
  }
  PLCHOST_TRY(sync_directory(order.folder));
  return order.boot;
}

}  // namespace

Result<std::string> carry_out(const StoreOrder& order) {
  return order.boot.empty() ? keep_file(order) : set_boot(order);
}

int store_main(std::string_view order) {
  const auto read = decode_store_order(order);
  // Nobody would hear of what it has kept: its manager is gone, or has given it up.
  if (read && !end_with_parent(read->parent, SIGKILL)) return static_cast<int>(ErrorCode::unavailable);
  const auto done = and_then(read, carry_out);
  fmt::print("{}", done ? *done : done.error().describe());
  return done ? 0 : static_cast<int>(done.error().code);
}

}  // namespace plchost
