#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <control.h>

#include "shm/base/time.hpp"

namespace plchost {

/// The load of the last minute, as it stands in /proc/loadavg; empty: it cannot be read from that.
[[nodiscard]] std::string load_average(std::string_view text);
/// A line of /proc/meminfo ("MemAvailable"), in MiB; empty: there is none.
[[nodiscard]] std::string memory_mib(std::string_view text, std::string_view name);

/// How much the machine has to do, as entries of HostStatus.ext; looked at every kPeriod.
class HostLoad {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(2);

  void look(TimePoint now);
  void add_to(std::vector<plc_KeyValue>& entries) const;

 private:
  TimePoint next_;
  std::string load_;
  std::string cores_;
  std::string memory_;
  std::string available_;
};

}  // namespace plchost
