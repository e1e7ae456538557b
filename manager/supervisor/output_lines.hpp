#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "shm/pages/log_ring.hpp"

namespace plchost {

/// Makes lines of what a process writes to its standard output and error, and says who said each of them.
class OutputLines {
 public:
  /// A line that is longer is handed on in parts.
  static constexpr std::size_t kMaxLine = 4096;
  using Take = std::function<void(const LogEntry&)>;

  /// `now_unix_ns`: the time of lines that tell none. The entry's text lasts for the call.
  void add(std::string_view bytes, std::int32_t pid, std::int64_t now_unix_ns, const Take& take);
  /// The process has ended: its last line may have no end.
  void end(std::int32_t pid, std::int64_t now_unix_ns, const Take& take);

 private:
  static void hand_on(std::string_view line, std::int32_t pid, std::int64_t now_unix_ns, const Take& take);
  std::string begun_;  // a line whose end has not come
};

}  // namespace plchost
