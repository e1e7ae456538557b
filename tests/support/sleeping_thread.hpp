#pragma once

#include <fstream>
#include <string>

#include <fmt/format.h>
#include <sys/types.h>

namespace plchost {

/// A thread of this process sleeps in the kernel.
inline bool sleeps(pid_t thread) {
  std::ifstream stat(fmt::format("/proc/self/task/{}/stat", thread));
  std::string text;
  std::getline(stat, text);
  const std::size_t name_end = text.rfind(") ");
  return name_end != std::string::npos && text.substr(name_end + 2, 1) == "S";
}

}  // namespace plchost
