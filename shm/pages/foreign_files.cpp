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
#include "shm/pages/flight_page.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/log_ring.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/pages/transition_ring.hpp"

namespace plchost {

namespace {

/// The users that a file may belong to.
enum class Owners : std::uint8_t { manager, instances, writers_of_pool, api_server };

// Nothing: the name is none of this host's.
std::optional<Owners> owners_of(std::string_view pool, const std::string& file) {
  if (const auto memory = memory_of_file(pool, file)) {
    constexpr std::string_view kOfInstances = ".retain";
    return memory->ends_with(kOfInstances) ? Owners::instances : Owners::writers_of_pool;
  }
  if (file.starts_with(pool_memory_name(pool, "")) && file.ends_with(node_locks_name("")))
    return Owners::writers_of_pool;
  const std::string downloads = fmt::format("{}.download.", pool);
  if (file == fmt::format("{}.posts", pool) || file.starts_with(downloads)) return Owners::api_server;
  const auto begins = [&](const std::string& begin) { return file.starts_with(begin); };
  const std::array of_manager = {transition_ring_name(pool, ""), log_ring_name(pool, ""),
                                 fmt::format("{}.wish.", pool)};
  if (file == pool || file == fmt::format("{}.clients", pool) || file == host_page_name(pool) ||
      std::ranges::any_of(of_manager, begins)) {
    return Owners::manager;
  }
  const std::array of_instances = {instance_page_name(pool, ""),       instance_claim_name(pool, ""),
                                   fmt::format("{}.variables.", pool), outputs_page_name(pool, ""),
                                   fmt::format("{}.debug.", pool),     flight_page_name(pool, "")};
  return std::ranges::any_of(of_instances, begins) ? std::optional(Owners::instances) : std::nullopt;
}

bool belongs(const struct stat& status, Owners owners, const MemoryRights& rights,
             std::optional<uid_t> api_server) {
  if (!S_ISREG(status.st_mode)) return false;
  if (owners == Owners::api_server && status.st_uid == api_server) return true;
  if (is_own_or_roots(status.st_uid) || status.st_uid == rights.owner) return true;
  const bool instances_have_some = owners == Owners::instances || owners == Owners::writers_of_pool;
  if (instances_have_some && is_trusted_owner(status.st_uid)) return true;
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

void protect_managers_files(std::string_view pool) noexcept {
  constexpr mode_t kPermissions = 07777;
  const std::string wishes = fmt::format("{}.wish.", pool);
  const std::string logs = log_ring_name(pool, "");
  std::error_code error;
  for (std::filesystem::directory_iterator at(MemoryFile::kDirectory, error), end; !error && at != end;
       at.increment(error)) {
    const std::string file = at->path().filename().string();
    const bool read_by_others = file == host_page_name(pool) || file.starts_with(logs);
    struct stat status{};
    if ((!read_by_others && !file.starts_with(wishes)) || ::lstat(at->path().c_str(), &status) != 0) continue;
    const mode_t mode = read_by_others ? 0640 : 0600;
    const bool own = S_ISREG(status.st_mode) && status.st_uid == ::geteuid();
    if (own && (status.st_mode & kPermissions) != mode) (void)::chmod(at->path().c_str(), mode);
  }
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
