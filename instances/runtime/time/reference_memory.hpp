#pragma once

#include <memory>
#include <string>
#include <utility>

#include "schedulers/distributed_clock/distributed_clock.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/reference_clock.hpp"

namespace plchost {

/// The reference record of the pool as the schedulers see it.
class ReferenceMemory {
 public:
  /// Makes `clock` follow the record of that name. Where there is none that can be used the clock runs freely
  /// until there is. `clock` is not used any more after drop(). Control thread.
  void follow(DistributedClock& clock, std::string pool, std::string name);
  /// Takes up a record that was made anew under the name, or lets go of one that is none any more; now and
  /// then. Control thread.
  void refresh();
  /// Why there is no record to follow; empty: there is one, or none is wanted.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }
  /// Before the clock goes.
  void drop() noexcept { clock_ = nullptr; }

 private:
  class Source;
  void attach();
  void tell(std::string problem);

  DistributedClock* clock_ = nullptr;
  std::string pool_;
  std::string name_;
  std::string problem_;
  std::unique_ptr<Source> source_;

 public:
  ReferenceMemory();
  ~ReferenceMemory();
  ReferenceMemory(const ReferenceMemory&) = delete;
  ReferenceMemory& operator=(const ReferenceMemory&) = delete;
};

/// How the status page describes the clock: all but the name of the record.
[[nodiscard]] ClockRuntime clock_runtime(const DistributedClock& clock) noexcept;

}  // namespace plchost
