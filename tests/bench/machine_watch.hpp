#pragma once

#include <cstdint>

#include "tests/bench/row.hpp"

namespace plchost::bench {

/// The other work that the machine did since this was made: it belongs to the figures of that time.
class MachineWatch {
 public:
  MachineWatch();
  /// load_average: over the minute before this was made. steal_percent: of the time of all cores that the
  /// hypervisor gave to others. other_cpu_percent: of it, what processes had that are neither this one nor
  /// its children.
  [[nodiscard]] Extra conditions() const;

 private:
  double load_;
  double steal_;
  double busy_;
  double all_;
  double own_;
};

}  // namespace plchost::bench
