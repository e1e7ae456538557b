#pragma once

#include <atomic>
#include <charconv>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

namespace plchost {

/// With which names of this PID namespace begin; their process's number follows.
inline std::string own_prefix() {
  struct stat pids{};
  (void)::stat("/proc/self/ns/pid", &pids);
  constexpr unsigned kShort = 0xffff;  // the name of a pool has at most 31 characters
  return fmt::format("plct-{:x}-", pids.st_ino & kShort);
}

/// The name was made by a process of this PID namespace that has ended.
inline bool is_left_behind(std::string_view name, std::string_view prefix) {
  if (!name.starts_with(prefix)) return false;
  name.remove_prefix(prefix.size());
  pid_t maker = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), maker);
  if (error != std::errc() || end == name.data() + name.size() || *end != '-' || maker <= 0) return false;
  return ::kill(maker, 0) != 0 && errno == ESRCH;
}

/// Removes what tests that were killed have left in a folder.
inline void remove_what_was_left_in(const std::filesystem::path& folder) {
  const std::string prefix = own_prefix();
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    std::error_code ignored;
    if (is_left_behind(entry.path().filename().string(), prefix)) {
      std::filesystem::remove_all(entry.path(), ignored);
    }
  }
}

/// A name for a pool, a file or a folder that no other test uses. The test removes what it makes under it.
/// A test that is killed cannot: the first name that a later test program makes removes it from /dev/shm and
/// from the folder of temporary files. All names with a process's number are made here. Any thread.
inline std::string own_name(std::string_view what) {
  [[maybe_unused]] static const bool kRemoved = [] {
    std::error_code ignored;
    remove_what_was_left_in("/dev/shm");
    remove_what_was_left_in(std::filesystem::temp_directory_path(ignored));
    return true;
  }();
  static std::atomic<int> count{0};
  return fmt::format("{}{}-{}-{}", own_prefix(), ::getpid(), ++count, what);
}

/// The same in the folder of temporary files.
inline std::filesystem::path own_path(std::string_view what) {
  return std::filesystem::temp_directory_path() / own_name(what);
}

}  // namespace plchost
