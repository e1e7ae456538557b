#include "api/recording/task_activity.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace plchost {

namespace {

/// Reads the entries of one task, in their order.
class Reading {
 public:
  Reading(std::int64_t begin_ns, std::int64_t end_ns) : begin_(begin_ns), end_(end_ns), last_(begin_ns) {}

  void pass(const RecordedRing::Gap& gap, std::int64_t next_ns) {
    close(last_, gap.process != 0 ? CycleCut::process_ended : CycleCut::entries_missing);
    next_ = {};
    first_ = false;
    if (gap.missing > 0) found_.missing.push_back({std::max(next_ns, last_), gap.missing});
  }

  void take(FlightEntry entry) {
    entry.time_ns = last_ = std::max(entry.time_ns, last_);
    if (std::exchange(first_, false)) begin_before(entry.kind);
    switch (entry.kind) {
      case FlightKind::lost:
        next_.lost = entry.figure;
        break;
      case FlightKind::taken:
        next_.post = static_cast<std::uint32_t>(entry.figure);
        return;
      case FlightKind::start:
        return start(entry);
      case FlightKind::end:
        if (!open_) break;
        open_->spun_ns = entry.figure;
        return close(entry.time_ns, open_->cut);
      case FlightKind::work:
        return work(entry);
      case FlightKind::halted:
        if (!open_) break;
        halted_ = entry.time_ns;
        return;
      case FlightKind::resumed:
        if (!halted_) break;
        return resume(entry.time_ns);
      case FlightKind::none:
      case FlightKind::posted:
      case FlightKind::moved:
      case FlightKind::fault:
      case FlightKind::started:
      case FlightKind::stopping:
      case FlightKind::switched:
      case FlightKind::held:
      case FlightKind::late:
      case FlightKind::struck:
      case FlightKind::polled:
        break;
    }
    found_.moments.push_back(entry);
  }

  TaskActivity finish(std::optional<std::int64_t> fault) {
    const bool faulty = open_ && fault && *fault >= open_->from;
    if (faulty) close(*fault, CycleCut::exception);
    close(std::max(end_, last_), CycleCut::goes_on);
    return std::move(found_);
  }

 private:
  // The first entry of a recording tells whether a cycle was under way when it began.
  void begin_before(FlightKind first) {
    const bool within = first == FlightKind::end || first == FlightKind::posted ||
                        first == FlightKind::halted || first == FlightKind::resumed;
    if (!within) return;
    open_ = RecordedCycle{.from = begin_, .cut = CycleCut::began_earlier};
    if (first == FlightKind::resumed) halted_ = begin_;
  }
  void start(const FlightEntry& entry) {
    close(entry.time_ns, CycleCut::entries_missing);
    open_ = std::exchange(next_, {});
    open_->from = entry.time_ns;
    open_->latency_ns = entry.figure;
  }
  void resume(std::int64_t time) {
    found_.halts.push_back({*std::exchange(halted_, std::nullopt), time, FlightKind::halted});
  }
  void close(std::int64_t time, CycleCut cut) {
    if (!open_) return;
    if (halted_) resume(time);
    open_->to = time;
    open_->cut = cut;
    free_since_ = time;
    found_.cycles.push_back(*std::exchange(open_, std::nullopt));
  }
  void work(const FlightEntry& entry) {
    if (open_ || entry.figure < 0) return found_.moments.push_back(entry);
    const std::int64_t since = std::max(free_since_, begin_);
    const std::int64_t from = entry.figure > entry.time_ns - since ? since : entry.time_ns - entry.figure;
    found_.work.push_back({from, entry.time_ns, FlightKind::work});
    free_since_ = entry.time_ns;
  }

  std::int64_t begin_;
  std::int64_t end_;
  std::int64_t last_;
  bool first_ = true;
  std::optional<RecordedCycle> open_;
  RecordedCycle next_;  // the cycle that starts next, as far as it was told
  std::optional<std::int64_t> halted_;
  std::int64_t free_since_ = 0;
  TaskActivity found_;
};

}  // namespace

std::string_view to_string(CycleCut cut) noexcept {
  switch (cut) {
    case CycleCut::none:
      break;
    case CycleCut::began_earlier:
      return "began before the recording";
    case CycleCut::goes_on:
      return "goes on behind the recording";
    case CycleCut::entries_missing:
      return "its end is missing";
    case CycleCut::process_ended:
      return "the process has ended";
    case CycleCut::exception:
      return "exception";
  }
  return "";
}

TaskActivity activity_of(const RecordedRing& ring, std::int64_t begin_ns, std::int64_t end_ns,
                         std::span<const RecordedFault> faults) {
  Reading reading(begin_ns, end_ns);
  auto gap = ring.gaps.begin();
  for (std::size_t i = 0; i < ring.entries.size(); ++i) {
    for (; gap != ring.gaps.end() && gap->before == i; ++gap) reading.pass(*gap, ring.entries[i].time_ns);
    reading.take(ring.entries[i]);
  }
  for (; gap != ring.gaps.end(); ++gap) reading.pass(*gap, begin_ns);
  std::optional<std::int64_t> fault;
  for (const RecordedFault& one : faults) {
    if (one.ring == ring.ring) fault = std::max(fault.value_or(one.time_ns), one.time_ns);
  }
  return reading.finish(fault);
}

}  // namespace plchost
