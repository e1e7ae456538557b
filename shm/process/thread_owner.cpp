#include "shm/process/thread_owner.hpp"

#include <charconv>
#include <fstream>

#include <fmt/format.h>

namespace plchost {

std::optional<ThreadOwner> owner_of_thread(std::uint32_t thread) {
  constexpr std::string_view kKey = "Tgid:\t";
  std::ifstream status(fmt::format("/proc/{}/status", thread));
  ThreadOwner owner;
  for (std::string line; owner.pid == 0 && std::getline(status, line);) {
    if (!line.starts_with(kKey)) continue;
    (void)std::from_chars(line.data() + kKey.size(), line.data() + line.size(), owner.pid);
  }
  if (owner.pid == 0) return std::nullopt;
  std::ifstream comm(fmt::format("/proc/{}/comm", owner.pid));
  std::getline(comm, owner.program);
  return owner;
}

}  // namespace plchost
