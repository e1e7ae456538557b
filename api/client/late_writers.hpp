#pragma once

#include <cstddef>
#include <map>
#include <span>

#include <dds/dds.h>

#include "shm/base/time.hpp"

namespace plchost {

/// Until when to wait for the hosts that DDS knows of and that have not shown themselves yet. Each gets
/// kPatience at most, so one that stands still delays no other for longer.
class LateWriters {
 public:
  static constexpr Duration kPatience = std::chrono::seconds(5);

  /// `late`: the writers of presences of hosts that are not seen yet. When the last of them is not waited for
  /// any more; TimePoint::min(): none is late. A writer that was not late at a call begins anew.
  [[nodiscard]] TimePoint until(std::span<const dds_instance_handle_t> late, TimePoint now);

 private:
  std::map<dds_instance_handle_t, TimePoint> since_;
};

}  // namespace plchost
