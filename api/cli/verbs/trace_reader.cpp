#include "api/cli/verbs/trace_reader.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "api/dds/page_sample.hpp"

namespace plchost {

Async<Result<std::vector<TracePart>>> TraceReader::read(ClientCore& core, TimePoint deadline) {
  const bool first = begin_ns_ < 0;
  const std::int64_t since = std::max(begin_ns_, last_ns_ - kOverlap.count());
  TraceQuery query{.after = first ? kAfterAllEntries : static_cast<std::uint64_t>(since)};
  std::vector<TracePart> parts;
  for (bool goes_on = true; goes_on;) {
    const TimePoint asked = MonotonicClock::now();
    PLCHOST_CO_TRY_ASSIGN(auto page, co_await core.read_trace(host_, instance_, query, deadline));
    const std::int64_t time = page.time_monotonic_ns;
    if (time < 0 || time < last_ns_) {
      co_return failure(ErrorCode::wrong_state,
                        fmt::format("the clock of host '{}' begins anew: it was booted", host_));
    }
    last_ns_ = time;
    if (first) {
      begin_ns_ = time;
      goes_on = false;
    } else {
      PLCHOST_CO_TRY_ASSIGN(goes_on, next_page(host_, page, query));
    }
    parts.push_back({.listing = std::move(page), .asked = asked, .answered = MonotonicClock::now()});
  }
  co_return parts;
}

}  // namespace plchost
