#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "api/recording/flight_recording.hpp"
#include "shm/base/flight_ring.hpp"

namespace plchost {

/// Why a cycle of a recording is not whole.
enum class CycleCut : std::uint8_t {
  none,
  began_earlier,    ///< before the recording
  goes_on,          ///< at the end of the recording
  entries_missing,  ///< its end was written over
  process_ended,
  exception,  ///< its task is stopped for good
};
[[nodiscard]] std::string_view to_string(CycleCut cut) noexcept;

/// A cycle of a task. Times of a recording are CLOCK_MONOTONIC of the host, in ns.
struct RecordedCycle {
  std::int64_t from = 0;
  std::int64_t to = 0;
  std::int64_t latency_ns = 0;  ///< since the planned release; only if it is known when the cycle began
  std::int64_t spun_ns = 0;     ///< ahead of it
  std::int64_t lost = 0;        ///< releases before it
  std::optional<std::uint32_t> post = std::nullopt;  ///< the lower half of the count of the event
  CycleCut cut = CycleCut::none;
};

/// The entries of a task as cycles. All of its times grow: an entry that is earlier than the one before it
/// counts as late as that one.
struct TaskActivity {
  struct Piece {
    std::int64_t from = 0;
    std::int64_t to = 0;
    FlightKind kind = FlightKind::none;
  };
  struct Missing {
    std::int64_t time_ns = 0;  ///< of the entry behind
    std::uint64_t count = 0;
  };
  std::vector<RecordedCycle> cycles;
  std::vector<Piece> halts;          ///< within cycles, in their order
  std::vector<Piece> work;           ///< of the runtime, between cycles
  std::vector<FlightEntry> moments;  ///< all other entries
  std::vector<Missing> missing;
};

/// A task in exception.
struct RecordedFault {
  std::uint32_t ring = 0;
  std::int64_t time_ns = 0;
};

[[nodiscard]] TaskActivity activity_of(const RecordedRing& ring, std::int64_t begin_ns, std::int64_t end_ns,
                                       std::span<const RecordedFault> faults);

}  // namespace plchost
