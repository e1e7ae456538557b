#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <contract_bounds.hpp>
#include <control.h>

#include "api/dds/page_sample.hpp"
#include "shm/base/flight_ring.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Which part of a flight recorder is asked for.
struct TraceQuery {
  std::uint64_t after = 0;  ///< later times only, by CLOCK_MONOTONIC of the host
};

/// A query with it finds no entry, only the host's clocks.
inline constexpr std::uint64_t kAfterAllEntries = INT64_MAX;

/// The query as it travels, and back.
[[nodiscard]] plc_ListPart part_of(const TraceQuery& query) noexcept;
[[nodiscard]] TraceQuery trace_query_of(const plc_ListPart& part) noexcept;

/// The part of a page of one thread.
struct TraceRing {
  std::uint32_t ring = 0;  ///< as the rings of a FlightPage are numbered
  std::string task;        ///< empty: it is none
  std::int32_t iec_priority = 0;
  std::uint32_t event_mark = 0;
  std::uint64_t first = 0;  ///< number of the first of the entries
  std::vector<FlightEntry> entries;
};

/// A part of the flight recorder of an instance.
struct TraceListing {
  std::int32_t pid = 0;  ///< 0: there is none
  std::int64_t time_monotonic_ns = 0;
  std::int64_t time_unix_ns = 0;
  bool complete = true;
  std::uint64_t next_after = 0;  ///< the next part is what comes after this time
  std::vector<TraceRing> rings = {};
};

/// The bound of a page, for all rings together.
inline constexpr std::size_t kPageTraceEntries = dds::bounds::TracePage::entries;

/// The part of the recorder that is asked for, at most kPageTraceEntries. An instance without one has none.
[[nodiscard]] Result<TraceListing> look_at_trace(std::string_view pool, std::string_view instance,
                                                 const TraceQuery& query);

/// Cuts rings that have the entries after a time to one page: as many as it has room for, the earliest first.
/// An entry counts as late as the earliest of those from it on, so a query for the next time finds the rest.
/// Of more than a page of one time the rest is left out.
void cut_to_page(TraceListing& listing, std::uint64_t after);

/// A listing as it travels.
class TracePageSample : public PageSample<plc_TracePage> {
 public:
  /// At most kPageTraceEntries.
  explicit TracePageSample(const TraceListing& listing);

 private:
  std::vector<plc_TraceRing> rings_;
  std::vector<plc_TraceEntry> entries_;
};

/// A host may be any program: counts that do not fit the page's entries end the list of rings.
[[nodiscard]] TraceListing listing_of(const plc_TracePage& page);

}  // namespace plchost
