#include "api/client/batch_poster.hpp"

#include <utility>

#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

Result<BatchPoster> BatchPoster::create(dds_entity_t participant, dds_entity_t topic,
                                        const std::string& host) {
  BatchPoster poster;
  auto publisher = dds::make_publisher(participant, dds::host_partition(host));
  if (!publisher) return std::unexpected(publisher.error());
  poster.publisher_ = std::move(*publisher);
  auto writer = dds::make_writer(poster.publisher_.get(), topic, dds::qos_of(dds::kEventBatch));
  if (!writer) return std::unexpected(writer.error());
  poster.writer_ = std::move(*writer);
  poster.source_ = dds::guid_of(poster.writer_.get());
  poster.source_.copy_to(poster.sample_.source);
  dds::copy_text(poster.sample_.host, host);
  return poster;
}

void BatchPoster::use_clock(const HostClock& clock) noexcept {
  // A host takes nothing whose time limit is by the clock of its server before.
  if (clock.epoch() != clock_.epoch()) last_write_ = TimePoint{};
  clock_ = clock;
}

void BatchPoster::post(std::span<const EventId> events, TimePoint now, TimePoint deadline) {
  deadline_ = deadline;
  names_.clear();
  for (const EventId& event : events) {
    plc_EventName& name = names_.emplace_back();
    dds::copy_text(name.instance, event.instance);
    dds::copy_text(name.event, event.event);
  }
  base_ = account_.sums();
  sample_.sequence_number = sample_.base_sequence = ++last_sequence_;
  write(now);
}

void BatchPoster::write(TimePoint now) {
  sample_.events._buffer = names_.data();
  sample_.events._length = sample_.events._maximum = static_cast<std::uint32_t>(names_.size());
  sample_.limit = clock_.limit_at(deadline_);
  (void)has_met_server();  // before: one that comes later has not got it
  // One that DDS did not take is repeated like a lost one.
  has_space_ = dds_write(writer_.get(), &sample_) == DDS_RETCODE_OK;
  last_write_ = now;
}

void BatchPoster::on_ack(const plc_EventAck& ack, TimePoint now) {
  if (dds::Guid::from(ack.source) != source_ || !epoch_.accept(ack.epoch, now)) return;
  account_.take(ack);
  heard_ = true;
}

bool BatchPoster::has_met_server() noexcept {
  const std::uint32_t met = readers_met(writer_.get());
  if (met == readers_met_) return false;
  readers_met_ = met;
  heard_ = false;
  return true;
}

TimePoint BatchPoster::repeat(TimePoint now) {
  const bool new_server = has_met_server();
  const Duration patience = heard_ && has_space_ ? EventPoster::kResend : EventPoster::kFirstResend;
  const TimePoint due = last_write_ + patience;
  if (acknowledged() || (now < due && !new_server)) return due;
  write(now);
  return now + patience;
}

}  // namespace plchost
