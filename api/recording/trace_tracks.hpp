#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "api/recording/flight_recording.hpp"
#include "api/recording/host_time.hpp"
#include "api/recording/perfetto_trace.hpp"

namespace plchost {

/// The recordings of one host.
struct HostRecording {
  std::string host;
  HostTime time = {};                                ///< to the clock of this process
  std::map<std::uint32_t, std::string> events = {};  ///< names by their marks, see event_mark()
  std::vector<FlightRecording> instances = {};
};

/// The figures of a trace.
struct TraceCounts {
  std::uint64_t cycles = 0;
  std::uint64_t flows = 0;    ///< posts by tasks that a cycle was for
  std::uint64_t missing = 0;  ///< entries that were written over before they were read
  std::uint64_t damaged = 0;  ///< that were none
};

/// Writes the tracks of all hosts on one axis. A host has its cores, events and instances, an instance its
/// tasks. Arrows lead from each post by a task to the cycles for it. `clocks`: of this process.
TraceCounts write_tracks(PerfettoTrace& trace, std::span<const HostRecording> hosts,
                         const TraceClocks& clocks);

}  // namespace plchost
