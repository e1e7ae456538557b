#include "shm/pages/foreign_files.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/log_ring.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/pages/transition_ring.hpp"

namespace plchost {

namespace {

/// The users that a file may belong to.
enum class Owners : std::uint8_t { trusted, writers_of_pool, api_server };

// Nothing: the name is none of this host's.
std::optional<Owners> owners_of(std::string_view pool, const std::string& file) {
  if (const auto memory = memory_of_file(pool, file)) {
    constexpr std::string_view kOfInstances = ".retain";
    return memory->ends_with(kOfInstances) ? Owners::trusted : Owners::writers_of_pool;
  }
  const std::string downloads = fmt::format("{}.download.", pool);
  if (file == fmt::format("{}.posts", pool) || file.starts_with(downloads)) return Owners::api_server;
  const std::array names = {std::string(pool), host_page_name(pool)};
  const std::array beginnings = {instance_page_name(pool, ""),   instance_claim_name(pool, ""),
                                 transition_ring_name(pool, ""), log_ring_name(pool, ""),
                                 fmt::format("{}.wish.", pool),  fmt::format("{}.variables.", pool),
                                 outputs_page_name(pool, ""),    fmt::format("{}.debug.", pool)};
  const bool ours =
      std::ranges::find(names, file) != names.end() ||
      std::ranges::any_of(beginnings, [&](const auto& begin) { return file.starts_with(begin); });
  return ours ? std::optional(Owners::trusted) : std::nullopt;
}

bool belongs(const struct stat& status, Owners owners, const MemoryRights& rights,
             std::optional<uid_t> api_server) {
  if (!S_ISREG(status.st_mode)) return false;
  if (owners == Owners::api_server && status.st_uid == api_server) return true;
  if (is_trusted_owner(status.st_uid) || status.st_uid == rights.owner) return true;
  // Only a member of a group can give a file to it.
  const bool of_group = status.st_gid == rights.group.value_or(::getegid()) && (rights.mode & S_IWGRP) != 0;
  return owners == Owners::writers_of_pool && (of_group || allows_to_write(rights, status.st_uid));
}

}  // namespace

std::vector<ForeignFile> take_away_foreign_files(std::string_view pool, const MemoryRights& rights,
                                                 std::optional<uid_t> api_server) {
  std::vector<ForeignFile> found;
  std::error_code error;
  for (std::filesystem::directory_iterator at(MemoryFile::kDirectory, error), end; !error && at != end;
       at.increment(error)) {
    const auto owners = owners_of(pool, at->path().filename().string());
    struct stat status{};
    if (!owners || ::lstat(at->path().c_str(), &status) != 0 || belongs(status, *owners, rights, api_server))
      continue;
    found.push_back({.path = at->path(),
                     .rights = describe_rights(status.st_uid, status.st_gid, status.st_mode),
                     .taken_away = {}});
  }
  for (ForeignFile& file : found) file.taken_away = take_away(file.path);
  return found;
}

void give_roots_files(std::string_view pool, gid_t group) noexcept {
  if (group == 0) return;
  constexpr auto kSame = static_cast<uid_t>(-1);
  std::error_code error;
  for (std::filesystem::directory_iterator at(MemoryFile::kDirectory, error), end; !error && at != end;
       at.increment(error)) {
    const std::string file = at->path().filename().string();
    struct stat status{};
    if (!file.starts_with(pool) || !owners_of(pool, file) || ::lstat(at->path().c_str(), &status) != 0)
      continue;
    const bool roots = S_ISREG(status.st_mode) && status.st_uid == ::geteuid() && status.st_gid == 0;
    if (roots) (void)::lchown(at->path().c_str(), kSame, group);
  }
}

}  // namespace plchost
