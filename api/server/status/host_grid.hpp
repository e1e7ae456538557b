#pragma once

#include <cstdint>
#include <string>

#include <control.h>

#include "shm/pages/instance_page.hpp"

namespace plchost {

/// A value in ns that moves by a little with each look would make each look news: rounded to 100.
[[nodiscard]] std::int64_t to_hundreds(std::int64_t ns) noexcept;

/// How far the cycles of a host's instances are from the clocks that they follow, as members of HostStatus.
class HostGrid {
 public:
  /// The clock of an instance, as its process tells it.
  void add(const ClockRuntime& clock);
  void put(plc_HostStatus& sample) const noexcept;

 private:
  std::uint32_t instances_ = 0;  // that follow a reference clock
  std::uint32_t in_sync_ = 0;    // of them
  std::uint32_t measured_ = 0;   // of them: offset_ns_ is of one
  std::int64_t offset_ns_ = 0;   // the furthest
  std::string reference_;        // of the instance that is the furthest off
};

}  // namespace plchost
