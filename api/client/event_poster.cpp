#include "api/client/event_poster.hpp"

#include <algorithm>
#include <utility>

#include "api/dds/error.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

Result<EventPoster> EventPoster::create(dds_entity_t participant, dds_entity_t topic,
                                        const std::string& host) {
  EventPoster poster;
  auto publisher = dds::make_publisher(participant, dds::host_partition(host));
  if (!publisher) return std::unexpected(publisher.error());
  poster.publisher_ = std::move(*publisher);
  auto writer = dds::make_writer(poster.publisher_.get(), topic, dds::qos_of(dds::kEventPost));
  if (!writer) return std::unexpected(writer.error());
  poster.writer_ = std::move(*writer);
  poster.source_ = dds::guid_of(poster.writer_.get());
  poster.source_.copy_to(poster.sample_.source);
  dds::copy_text(poster.sample_.host, host);
  return poster;
}

bool has_reader(dds_entity_t writer) noexcept {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK && status.current_count > 0;
}

std::uint32_t readers_met(dds_entity_t writer) noexcept {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK ? status.total_count : 0;
}

dds_return_t EventPoster::write(std::uint64_t sequence) noexcept {
  sample_.sequence_number = sequence;
  sample_.base_sequence = unacknowledged_.empty() ? sequence : unacknowledged_.front().sequence;
  return dds_write(writer_.get(), &sample_);
}

void EventPoster::wait_for(Duration patience, const HostClock& clock) noexcept {
  patience_ = patience;
  // A host takes nothing whose time limit is by the clock of its server before.
  if (clock.epoch() != clock_.epoch() && !unacknowledged_.empty()) last_write_ = TimePoint{};
  clock_ = clock;
}

dds_return_t EventPoster::write(const Unacknowledged& post) noexcept {
  dds::copy_text(sample_.instance, post.instance);
  dds::copy_text(sample_.event, post.event);
  plc_KeyValue entry{};
  if (post.awaited) {
    dds::copy_text(entry.name, dds::kWaitEntry);
    dds::copy_text(entry.value, dds::kWaitForRun);
    sample_.ext = {._maximum = 1, ._length = 1, ._buffer = &entry, ._release = false};
  }
  sample_.limit = clock_.limit_at(last_progress_ + patience_);
  const dds_return_t written = write(post.sequence);
  has_space_ = written == DDS_RETCODE_OK;
  sample_.limit = {};
  sample_.ext = {};
  return written;
}

std::uint64_t EventPoster::post(std::string_view instance, std::string_view event, TimePoint now,
                                bool awaited) {
  if (unacknowledged_.empty()) {
    last_progress_ = now;
    (void)has_met_server();  // before it is written: one that comes later has not got it
  }
  unacknowledged_.push_back({++last_sequence_, std::string(instance), std::string(event), awaited});
  (void)write(unacknowledged_.back());  // one that DDS did not take is repeated like a lost one
  last_write_ = now;
  return last_sequence_;
}

void EventPoster::ask_again(std::uint64_t number, std::string_view instance, std::string_view event) {
  (void)write({number, std::string(instance), std::string(event), /*awaited=*/true});
}

Result<void> EventPoster::post_once(std::string_view instance, std::string_view event) noexcept {
  dds::copy_text(sample_.instance, instance);
  dds::copy_text(sample_.event, event);
  static plc_KeyValue late = [] {
    plc_KeyValue entry{};
    dds::copy_text(entry.name, dds::kAckEntry);
    dds::copy_text(entry.value, dds::kAckLate);
    return entry;
  }();
  sample_.ext = {._maximum = 1, ._length = 1, ._buffer = &late, ._release = false};
  const dds_return_t written = write(++last_sequence_);
  sample_.ext = {};
  return dds::check_code(written, "post an event");
}

bool EventPoster::on_ack(const plc_EventAck& ack, TimePoint now) {
  if (dds::Guid::from(ack.source) != source_ || !epoch_.accept(ack.epoch, now)) return false;
  const std::uint64_t before_epoch = account_.newest().epoch;
  const bool new_server = before_epoch != 0 && ack.epoch != before_epoch;
  account_.take(ack);
  answered_ = true;
  heard_ = true;
  window_ = std::clamp<std::size_t>(ack.credits, 1, kWindow);
  const std::size_t before = unacknowledged_.size();
  while (!unacknowledged_.empty() && unacknowledged_.front().sequence <= ack.sequence_number) {
    unacknowledged_.pop_front();
  }
  if (new_server)
    last_write_ = TimePoint{};  // posts that the one before took and did not do are repeated
                                // now
  if (unacknowledged_.size() == before) return false;
  last_progress_ = now;
  return true;
}

TimePoint EventPoster::repeat(TimePoint now) {
  if (unacknowledged_.empty()) return now + kResend;
  const bool met = has_met_server();
  const TimePoint due = std::max(last_progress_, last_write_) + patience_until_repeated();
  const bool new_server = last_write_ == TimePoint{} || met;
  if (!new_server && now < due) return due;
  for (const Unacknowledged& post : unacknowledged_) {
    if (write(post) != DDS_RETCODE_OK || !(new_server || answered_)) break;
  }
  answered_ = false;
  last_write_ = now;
  return now + patience_until_repeated();
}

bool EventPoster::has_met_server() noexcept {
  const std::uint32_t met = readers_met(writer_.get());
  if (met == readers_met_) return false;
  readers_met_ = met;
  heard_ = false;
  return true;
}

Duration EventPoster::patience_until_repeated() const noexcept {
  return heard_ && has_space_ ? kResend : kFirstResend;
}

void EventPoster::begin_report(TimePoint now) {
  unacknowledged_.clear();
  base_ = account_.sums();
  last_progress_ = now;
}

PostReport EventPoster::report() const {
  PostReport report = account_.report_since(base_);
  report.unacknowledged = unacknowledged_.size();
  return report;
}

namespace {

/// The number before the first one that the ledger counts: it is the same as long as the ledger is.
std::uint64_t origin_of(const plc_EventAck& ack) noexcept {
  return ack.sequence_number - ack.accepted - ack.rejected - ack.lost;
}

}  // namespace

void AckAccount::take(const plc_EventAck& ack) {
  if (newest_.epoch != 0 && origin_of(ack) != origin_of(newest_)) earlier_ = sums();
  newest_ = ack;
  newest_.ext = {};
  if (ack.rejected == 0) return;
  rejected_code_ = static_cast<ErrorCode>(ack.rejected_code);
  rejected_text_ = dds::text_of(ack.rejected_text);
}

AckAccount::Sums AckAccount::sums() const noexcept {
  return {.accepted = earlier_.accepted + newest_.accepted,
          .no_task = earlier_.no_task + newest_.no_task,
          .rejected = earlier_.rejected + newest_.rejected,
          .lost = earlier_.lost + newest_.lost};
}

PostReport AckAccount::report_since(const Sums& base) const {
  const Sums now = sums();
  PostReport report;
  report.accepted = now.accepted - base.accepted;
  report.no_task = now.no_task - base.no_task;
  report.rejected = now.rejected - base.rejected;
  report.lost = now.lost - base.lost;
  if (report.rejected > 0) {
    report.rejected_code = rejected_code_;
    report.rejected_text = rejected_text_;
  }
  return report;
}

}  // namespace plchost
