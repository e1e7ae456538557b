#include "api/dds/trace_page.hpp"

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

namespace {

static_assert(dds::bounds::TracePage::rings == kFirstTaskRing + kMaxTasks);

constexpr std::int64_t time_of(std::uint64_t after) noexcept {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(after, INT64_MAX));
}

/// Of each entry, the earliest time from it on.
std::vector<std::int64_t> times_from_here_on(const std::vector<FlightEntry>& entries) {
  std::vector<std::int64_t> times(entries.size());
  std::int64_t least = INT64_MAX;
  for (std::size_t i = entries.size(); i-- > 0;) times[i] = least = std::min(least, entries[i].time_ns);
  return times;
}

TraceRing ring_of(const FlightPageReader& page, std::size_t number, std::int64_t after) {
  TraceRing ring{.ring = static_cast<std::uint32_t>(number), .task = {}, .entries = {}};
  if (number >= kFirstTaskRing) {
    const std::size_t task = number - kFirstTaskRing;
    ring.task = page.task_name(task);
    ring.iec_priority = page.iec_priority(task);
    ring.event_mark = page.event_mark(task) & kEventMarkMask;
  }
  FlightRing::Read read = page.read_after(number, after);
  ring.entries = std::move(read.entries);
  ring.first = read.next - ring.entries.size();
  return ring;
}

}  // namespace

plc_ListPart part_of(const TraceQuery& query) noexcept {
  plc_ListPart part{};
  part.after = query.after;
  return part;
}

TraceQuery trace_query_of(const plc_ListPart& part) noexcept {
  return {.after = part.after};
}

void cut_to_page(TraceListing& listing, std::uint64_t after) {
  std::vector<std::vector<std::int64_t>> times;
  std::vector<std::int64_t> all;
  for (const TraceRing& ring : listing.rings) {
    times.push_back(times_from_here_on(ring.entries));
    all.insert(all.end(), times.back().begin(), times.back().end());
  }
  listing.complete = all.size() <= kPageTraceEntries;
  const std::int64_t begin = time_of(after);
  if (listing.complete) {
    listing.next_after = static_cast<std::uint64_t>(all.empty() ? begin : std::ranges::max(all));
    return;
  }
  const auto over = all.begin() + static_cast<std::ptrdiff_t>(kPageTraceEntries);
  std::ranges::nth_element(all, over);
  // The page ends before the time of the first entry that has no room, unless all are of that time.
  std::int64_t last = *over > begin ? *over - 1 : begin;
  if (std::ranges::none_of(all, [&](std::int64_t time) { return time <= last; })) last = *over;
  std::size_t room = kPageTraceEntries;
  for (std::size_t i = 0; i < listing.rings.size(); ++i) {
    const auto end = std::ranges::upper_bound(times[i], last);
    const std::size_t count = std::min(room, static_cast<std::size_t>(end - times[i].begin()));
    listing.rings[i].entries.resize(count);
    room -= count;
  }
  listing.next_after = static_cast<std::uint64_t>(last);
}

Result<TraceListing> look_at_trace(std::string_view pool, std::string_view instance,
                                   const TraceQuery& query) {
  TraceListing listing;
  PLCHOST_TRY_ASSIGN(const auto page, if_found(FlightPageReader::open(pool, instance)));
  if (page) {
    listing.pid = page->pid();
    const std::size_t rings = kFirstTaskRing + page->task_count();
    for (std::size_t number = 0; number < rings; ++number)
      listing.rings.push_back(ring_of(*page, number, time_of(query.after)));
  }
  cut_to_page(listing, query.after);
  // Behind the entries, so that none of them is later.
  listing.time_monotonic_ns = MonotonicClock::now().time_since_epoch().count();
  listing.time_unix_ns = unix_time_ns();
  return listing;
}

TracePageSample::TracePageSample(const TraceListing& listing) {
  page_.pid = listing.pid;
  page_.time_monotonic_ns = listing.time_monotonic_ns;
  page_.time_unix_ns = listing.time_unix_ns;
  page_.complete = listing.complete;
  page_.next_after = listing.next_after;
  for (const TraceRing& ring : listing.rings) {
    plc_TraceRing& told = rings_.emplace_back();
    told = {.ring = ring.ring,
            .task = {},
            .iec_priority = ring.iec_priority,
            .event_mark = ring.event_mark,
            .first = ring.first,
            .entry_count = static_cast<std::uint32_t>(ring.entries.size())};
    dds::copy_text(told.task, ring.task);
    std::ranges::transform(ring.entries, std::back_inserter(entries_), [](const FlightEntry& entry) {
      return plc_TraceEntry{
          .time_ns = entry.time_ns, .kind = std::to_underlying(entry.kind), .figure = entry.figure};
    });
  }
  dds::lend(page_.rings, rings_);
  dds::lend(page_.entries, entries_);
}

TraceListing listing_of(const plc_TracePage& page) {
  TraceListing listing{.pid = page.pid,
                       .time_monotonic_ns = page.time_monotonic_ns,
                       .time_unix_ns = page.time_unix_ns,
                       .complete = page.complete,
                       .next_after = page.next_after};
  std::span<const plc_TraceEntry> rest = dds::parts_of(page.entries);
  for (const plc_TraceRing& told : dds::parts_of(page.rings)) {
    if (told.entry_count > rest.size()) break;
    TraceRing& ring = listing.rings.emplace_back(TraceRing{.ring = told.ring,
                                                           .task = std::string(dds::text_of(told.task)),
                                                           .iec_priority = told.iec_priority,
                                                           .event_mark = told.event_mark,
                                                           .first = told.first,
                                                           .entries = {}});
    for (const plc_TraceEntry& entry : rest.first(told.entry_count)) {
      // A kind that no entry of a recorder can have is none.
      const auto kind = entry.kind <= UINT8_MAX ? static_cast<FlightKind>(entry.kind) : FlightKind::none;
      ring.entries.push_back({.time_ns = entry.time_ns, .kind = kind, .figure = entry.figure});
    }
    rest = rest.subspan(told.entry_count);
  }
  return listing;
}

}  // namespace plchost
