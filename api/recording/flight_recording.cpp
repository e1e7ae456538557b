#include "api/recording/flight_recording.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/pages/flight_page.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMostRings = dds::bounds::TracePage::rings;

// Those of other processes of the instance count, too: a stranger may change the PID each time.
constexpr std::size_t kMostRecordedRings = 4 * kMostRings;

std::string name_of(const TraceRing& told) {
  if (told.ring < kFirstTaskRing) return {};
  return told.task.empty() ? fmt::format("task {}", told.ring - kFirstTaskRing) : printable(told.task);
}

// One for all that happens between two entries.
RecordedRing::Gap& gap_here(RecordedRing& ring) {
  const bool is_known = !ring.gaps.empty() && ring.gaps.back().before == ring.entries.size();
  if (!is_known) ring.gaps.push_back({.before = ring.entries.size(), .missing = 0, .process = 0});
  return ring.gaps.back();
}

}  // namespace

void FlightRecording::add(const TraceListing& listing) {
  const bool first = pages_++ == 0;
  if (first) begin_ns_ = listing.time_monotonic_ns;
  end_ns_ = std::max(end_ns_, listing.time_monotonic_ns);
  if (listing.pid == 0) return;
  if (std::exchange(pid_, listing.pid) != listing.pid && !first) begin_process(listing.pid);
  for (const TraceRing& told : listing.rings) {
    RecordedRing* const ring = ring_of(told);
    if (ring == nullptr) {
      damaged_ += told.entries.size();
    } else if (first) {
      ring->next_ = told.first + told.entries.size();
    } else {
      add(*ring, told, listing.time_monotonic_ns);
    }
  }
}

void FlightRecording::begin_process(std::int32_t pid) {
  for (RecordedRing& ring : rings_) {
    ring.next_ = 0;
    gap_here(ring).process = pid;
  }
}

// A task is found by its name: another process may number its tasks in another way.
RecordedRing* FlightRecording::ring_of(const TraceRing& told) {
  if (told.ring >= kMostRings) return nullptr;
  std::string task = name_of(told);
  const bool is_task = told.ring >= kFirstTaskRing;
  auto ring = std::ranges::find_if(rings_, [&](const RecordedRing& known) {
    return is_task ? known.task == task : known.ring == told.ring;
  });
  if (ring == rings_.end()) {
    if (rings_.size() == kMostRecordedRings) return nullptr;
    ring = rings_.emplace(ring);
    ring->task = std::move(task);
  } else if (ring->page_ == pages_) {
    return nullptr;  // twice in one page
  }
  ring->page_ = pages_;
  ring->ring = told.ring;
  ring->iec_priority = told.iec_priority;
  ring->event_mark = told.event_mark;
  return &*ring;
}

void FlightRecording::add(RecordedRing& ring, const TraceRing& told, std::int64_t until_ns) {
  const std::uint64_t count = told.entries.size();
  if (told.first > std::numeric_limits<std::uint64_t>::max() - count) {
    damaged_ += count;
    return;
  }
  if (count == 0 || told.first + count <= ring.next_) return;  // all of it was seen
  if (told.first > ring.next_) {
    gap_here(ring).missing += told.first - ring.next_;
    missing_ += told.first - ring.next_;
  }
  const std::uint64_t seen = ring.next_ > told.first ? ring.next_ - told.first : 0;
  for (std::uint64_t i = seen; i < count; ++i) {
    const FlightEntry& entry = told.entries[i];
    const bool possible =
        entry.kind != FlightKind::none && entry.time_ns >= begin_ns_ && entry.time_ns <= until_ns;
    if (possible) ring.entries.push_back(entry);
    (possible ? entries_ : damaged_) += 1;
  }
  ring.next_ = told.first + count;
}

}  // namespace plchost
