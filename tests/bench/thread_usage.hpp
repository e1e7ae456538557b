#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

#include "shm/base/time.hpp"

namespace plchost::bench {

/// The processor time of threads so far.
struct ThreadUsage {
  Duration cpu{};
  std::uint64_t voluntary = 0;    ///< context switches: they went to sleep
  std::uint64_t involuntary = 0;  ///< context switches: they were pre-empted

  [[nodiscard]] ThreadUsage operator-(const ThreadUsage& before) const noexcept {
    return {cpu - before.cpu, voluntary - before.voluntary, involuntary - before.involuntary};
  }
  ThreadUsage& operator+=(const ThreadUsage& other) noexcept;
  [[nodiscard]] std::uint64_t switches() const noexcept { return voluntary + involuntary; }
};

/// Of all threads of this process but the calling one, so that whatever a scheduler runs beside the task
/// counts with it. The threads are the same ones at both ends of a measurement. `name`: only the thread of
/// that name.
[[nodiscard]] ThreadUsage usage_of_other_threads(std::string_view name = {});

}  // namespace plchost::bench
