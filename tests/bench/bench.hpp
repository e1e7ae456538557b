#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/threads/thread.hpp"

namespace plchost::bench {

/// How much is measured, and where.
struct Plan {
  Duration each = std::chrono::seconds(60);  ///< of each thing that is measured, all slices together
  Duration slice = std::chrono::seconds(5);  ///< at most; things take turns
  Duration post_gap = std::chrono::milliseconds(1);
  int starts = 100;                 ///< of a program
  std::uint32_t objects = 100'000;  ///< that are made, opened and closed
  int hosts = 24;                   ///< of the fleet, beside one of 8
  int task_core = 1;
  int poster_core = 0;
  std::filesystem::path programs;  ///< where plchostd and its helpers are

  /// How often each thing has its turn, if a turn is at most `limit`.
  [[nodiscard]] int slices(Duration limit) const noexcept {
    return static_cast<int>((each + limit - Duration(1)) / limit);
  }
};

/// The priority that every measured thread and every floor has: IEC 0 in the normal band.
inline constexpr ThreadPriority kPriority{.fifo = 67};

/// Of each slice, not measured: threads start, the guard of CmpScheduleOneShot settles. Floors as well.
inline constexpr Duration kWarmUp = std::chrono::milliseconds(200);

/// Makes this process like an instance: memory locked, idle states held off, timer slack 1 ns.
[[nodiscard]] Result<void> prepare_process();

/// The calling thread, and what it starts, runs on one core until this goes.
class OnCore {
 public:
  explicit OnCore(int core);
  OnCore(const OnCore&) = delete;
  OnCore& operator=(const OnCore&) = delete;
  ~OnCore();

 private:
  std::vector<int> before_;
};

/// Binds the calling thread for good.
[[nodiscard]] Result<void> bind_thread(const std::vector<int>& cores);

/// Runs for that long, and notes what it measures.
using Subject = std::function<Result<void>(Duration slice)>;

/// The subjects take turns until each of them ran for plan.each, so that all see the same minutes.
/// `longest` bounds a slice further.
[[nodiscard]] Result<void> alternate(const Plan& plan, const std::vector<Subject>& subjects,
                                     Duration longest = Duration::max());

}  // namespace plchost::bench
