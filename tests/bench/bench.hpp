#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/thread.hpp"
#include "tests/bench/samples.hpp"

namespace plchost::bench {

/// How much is measured, and where.
struct Plan {
  int slices = 40;                                  ///< of each kind, in alternation
  Duration slice = std::chrono::milliseconds(500);  ///< of a cyclic measurement
  int posts = 500;                                  ///< in one slice of a post measurement
  Duration gap = std::chrono::milliseconds(1);      ///< between two posts
  int task_core = 1;
  int poster_core = 0;
  std::filesystem::path programs;                    ///< where plchostd and its helpers are
  std::function<void(const std::string&)> progress;  ///< told before each measurement
};

/// The priority that every measured thread and every floor has: IEC 0 in the normal band.
inline constexpr ThreadPriority kPriority{.fifo = 67};

/// Makes this process like an instance: memory locked, idle states held off, timer slack 1 ns.
[[nodiscard]] Result<void> prepare_process();

/// Binds the calling thread.
[[nodiscard]] Result<void> bind_thread(int core);

[[nodiscard]] Result<std::vector<Row>> measure_cyclic(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_post_process(const Plan& plan);
[[nodiscard]] Result<std::vector<Row>> measure_post_dds(const Plan& plan);

}  // namespace plchost::bench
