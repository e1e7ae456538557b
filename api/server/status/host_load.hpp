#pragma once

#include <cstdint>
#include <string_view>

#include <control.h>

#include "shm/base/time.hpp"

namespace plchost {

/// The load of the last minute in percent of one processor, by the text of /proc/loadavg; -1: it is none.
[[nodiscard]] std::int32_t load_percent(std::string_view text);
/// A line of /proc/meminfo ("MemAvailable"), in MiB; 0: there is none.
[[nodiscard]] std::uint64_t memory_mib(std::string_view text, std::string_view name);

/// How much the machine has to do, as members of HostStatus; looked at every kPeriod.
class HostLoad {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(2);

  void look(TimePoint now);
  void put(plc_HostStatus& sample) const noexcept;

 private:
  TimePoint next_;
  std::int32_t load_percent_ = -1;
  std::uint32_t cores_ = 0;
  std::uint64_t memory_mib_ = 0;
  std::uint64_t available_mib_ = 0;
};

}  // namespace plchost
