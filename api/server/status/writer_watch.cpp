#include "api/server/status/writer_watch.hpp"

#include <algorithm>
#include <functional>
#include <vector>

namespace plchost {

namespace {

// When the one of so many that are gone has posted that is the last to be shown.
TimePoint oldest_shown(std::vector<TimePoint> gone, std::size_t most) {
  if (gone.size() <= most) return TimePoint::min();
  const auto last = gone.begin() + static_cast<std::ptrdiff_t>(most - 1);
  std::ranges::nth_element(gone, last, std::greater{});
  return *last;
}

}  // namespace

bool WriterWatch::look(const EventIntake& intake, const SessionTable& sessions, TimePoint now) {
  if (now < next_look_) return false;
  next_look_ = now + kPeriod;
  bool changed = false;
  table_->begin_round();
  const auto writers = intake.writers();
  const auto is_present = [&](const EventIntake::Writer& writer) {
    return sessions.is_alive(writer.source.participant());
  };
  std::vector<TimePoint> gone;
  for (const EventIntake::Writer& writer : writers) {
    if (!is_present(writer)) gone.push_back(writer.used);
  }
  const TimePoint oldest = std::max(now - kKept, oldest_shown(std::move(gone), kMostGone));
  for (const EventIntake::Writer& writer : writers) {
    const bool all = writer.source == dds::Guid{};
    const bool present = !all && is_present(writer);
    if (!all && !present && writer.used < oldest) continue;
    plc_WriterStatus sample = table_->blank();
    writer.source.copy_to(sample.source);
    sample.received = writer.counters.received;
    sample.delivered = writer.counters.accepted;
    sample.no_task = writer.counters.no_task;
    sample.rejected = writer.counters.rejected + writer.counters.malformed;
    sample.duplicate = writer.counters.duplicate;
    sample.early = writer.counters.early;
    sample.lost = writer.counters.lost;
    sample.last_sequence = writer.last;
    const bool ever = writer.used != TimePoint{};
    sample.last_unix_ns = ever ? (writer.used.time_since_epoch() + to_unix_).count() : 0;
    sample.present = present;
    changed |= table_->update(writer.source.hex(), sample);
  }
  changed |= table_->dispose_rest();
  table_->write();
  return changed;
}

}  // namespace plchost
