#include "api/server/posts/writer_watch.hpp"

#include "api/dds/text.hpp"

namespace plchost {

bool WriterWatch::look(const EventIntake& intake, const SessionTable& sessions, TimePoint now) {
  if (now < next_look_) return false;
  next_look_ = now + kPeriod;
  bool changed = false;
  table_.begin_round();
  for (const EventIntake::Writer& writer : intake.writers()) {
    const bool all = writer.source == dds::Guid{};
    const bool present = !all && sessions.is_alive(writer.source.participant());
    if (!all && !present && writer.used + kKept < now) continue;
    plc_WriterStatus sample{};
    dds::copy_text(sample.host, host_);
    writer.source.copy_to(sample.source);
    sample.epoch = epoch_;
    sample.received = writer.counters.received;
    sample.delivered = writer.counters.accepted;
    sample.no_task = writer.counters.no_task;
    sample.rejected = writer.counters.rejected;
    sample.duplicate = writer.counters.duplicate;
    sample.early = writer.counters.early;
    sample.lost = writer.counters.lost;
    sample.last_sequence = writer.last;
    const bool ever = writer.used != TimePoint{};
    sample.last_unix_ns = ever ? (writer.used.time_since_epoch() + to_unix_).count() : 0;
    sample.present = present;
    changed |= table_.update(writer.source.hex(), sample);
  }
  changed |= table_.dispose_rest();
  table_.write();
  return changed;
}

}  // namespace plchost
