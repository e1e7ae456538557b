#include "shm/files/pool_files.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/memory_rights.hpp"

namespace plchost {

namespace {

bool is_plain_in_file_names(char c) noexcept {
  return is_name_character(c) || static_cast<unsigned char>(c) >= 0x80;
}

}  // namespace

std::string pool_memory_name(std::string_view pool, std::string_view name) {
  std::string file = fmt::format("{}.memory.", pool);
  for (const char c : name) {
    if (is_plain_in_file_names(c)) {
      file += c;
    } else {
      fmt::format_to(std::back_inserter(file), "%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return file;
}

std::optional<std::string> memory_of_file(std::string_view pool, std::string_view file) {
  const std::string prefix = pool_memory_name(pool, "");
  if (!file.starts_with(prefix)) return std::nullopt;
  std::string name;
  for (std::size_t at = prefix.size(); at < file.size(); ++at) {
    if (file[at] != '%') {
      name += file[at];
      continue;
    }
    unsigned byte = 0;
    constexpr int kHexadecimal = 16;
    const std::string_view digits = file.substr(at + 1, 2);
    if (std::from_chars(digits.begin(), digits.end(), byte, kHexadecimal).ptr != file.data() + at + 3) {
      return std::nullopt;
    }
    name += static_cast<char>(byte);
    at += 2;
  }
  // Written in another way it is another file.
  const bool same = is_object_name(name) && pool_memory_name(pool, name) == file;
  return same ? std::optional(std::move(name)) : std::nullopt;
}

std::string node_locks_name(std::string_view directory) {
  return fmt::format("{}%locks", directory);
}

void remove_pool_memories(std::string_view pool, std::span<const std::string> kept) noexcept {
  const std::string prefix = pool_memory_name(pool, "");
  const auto stays = [&](const std::string& file) {
    return std::ranges::any_of(kept,
                               [&](const std::string& name) { return pool_memory_name(pool, name) == file; });
  };
  std::error_code error;
  for (std::filesystem::directory_iterator at(MemoryFile::kDirectory, error), end; !error && at != end;
       at.increment(error)) {
    const std::string name = at->path().filename();
    if (name.starts_with(prefix) && !stays(name)) ::unlink(at->path().c_str());
  }
}

bool may_write_pool(std::string_view pool, uid_t user) {
  struct stat status{};
  if (::stat(MemoryFile::path(pool).c_str(), &status) != 0) return false;
  // The pool's group is theirs also where no account says so.
  const auto of_instances = users_of_instances();
  const bool by_group =
      (status.st_mode & S_IWGRP) != 0 && std::ranges::find(of_instances, user) != of_instances.end();
  return user == ::geteuid() || by_group ||
         allows_to_write({.owner = status.st_uid, .group = status.st_gid, .mode = status.st_mode}, user);
}

bool may_own_memory(std::string_view pool, uid_t user) {
  return is_trusted_owner(user) || may_write_pool(pool, user);
}

}  // namespace plchost
