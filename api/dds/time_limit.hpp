#pragma once

#include <cstdint>

#include <control.h>

#include "shm/base/time.hpp"

namespace plchost::dds {

/// A host's decision about the time limit of a request, a post or a piece of a download.
enum class Timeliness : std::uint8_t {
  in_time,
  late,         ///< its writer has given up: it must not be done
  other_epoch,  ///< by the clock of another plchost-dds: when in doubt it is not done; it comes again
  unlimited,    ///< it has no limit
};

[[nodiscard]] inline Timeliness timeliness(const plc_TimeLimit& limit, std::uint64_t epoch,
                                           std::int64_t now_ns = boot_time_ns()) noexcept {
  if (limit.epoch == 0) return Timeliness::unlimited;
  if (limit.epoch != epoch) return Timeliness::other_epoch;
  return now_ns <= limit.clock_ns ? Timeliness::in_time : Timeliness::late;
}

}  // namespace plchost::dds
