#include "api/client/poster.hpp"

#include <algorithm>
#include <utility>

#include "api/dds/error.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

namespace {

void set_events(plc_EventPost& sample, std::span<plc_EventName> events) noexcept {
  dds::copy_text(sample.instance, dds::text_of(events.front().instance));
  dds::copy_text(sample.event, dds::text_of(events.front().event));
}

void set_events(plc_EventBatch& sample, std::span<plc_EventName> events) noexcept {
  dds::lend(sample.events, events);
}

}  // namespace

template <class Sample>
Result<Poster<Sample>> Poster<Sample>::create(dds_entity_t participant, dds_entity_t topic,
                                              const std::string& host) {
  Poster poster;
  PLCHOST_TRY_ASSIGN(poster.way_, dds::open_writer(participant, dds::host_partition(host), topic,
                                                   dds::qos_of(dds::kTopicOf<Sample>)));
  poster.source_ = dds::guid_of(poster.way_.writer.get());
  poster.source_.copy_to(poster.sample_.source);
  dds::copy_text(poster.sample_.host, host);
  return poster;
}

template <class Sample>
dds_return_t Poster<Sample>::write(std::uint64_t sequence) noexcept {
  sample_.sequence_number = sequence;
  sample_.base_sequence =
      unacknowledged_.empty() ? sequence : std::min(sequence, unacknowledged_.front().sequence);
  return dds_write(way_.writer.get(), &sample_);
}

template <class Sample>
void Poster<Sample>::wait_for(Duration patience, const HostClock& clock) noexcept {
  patience_ = patience;
  // A host takes nothing whose time limit is by the clock of its server before.
  if (clock.epoch() != clock_.epoch() && !unacknowledged_.empty()) last_write_ = TimePoint{};
  clock_ = clock;
}

template <class Sample>
std::vector<plc_EventName> Poster<Sample>::names_of(std::span<const EventId> events) {
  std::vector<plc_EventName> names(events.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    dds::copy_text(names[i].instance, events[i].instance);
    dds::copy_text(names[i].event, events[i].event);
  }
  return names;
}

template <class Sample>
dds_return_t Poster<Sample>::write(Unacknowledged& post) noexcept {
  set_events(sample_, post.events);
  sample_.wait_run = post.awaited;
  sample_.limit = clock_.limit_at(last_progress_ + patience_);
  const dds_return_t written = write(post.sequence);
  has_space_ = written == DDS_RETCODE_OK;
  sample_.limit = {};
  sample_.wait_run = false;
  return written;
}

template <class Sample>
std::uint64_t Poster<Sample>::post(std::span<const EventId> events, TimePoint now, bool awaited) {
  if (unacknowledged_.empty()) {
    last_progress_ = now;
    (void)has_met_server();  // before it is written: one that comes later has not got it
  }
  unacknowledged_.push_back({++last_sequence_, names_of(events), awaited});
  (void)write(unacknowledged_.back());  // one that DDS did not take is repeated like a lost one
  last_write_ = now;
  return last_sequence_;
}

template <class Sample>
void Poster<Sample>::ask_again(std::uint64_t number, const EventId& event) {
  Unacknowledged post{number, names_of({&event, 1}), /*awaited=*/true};
  (void)write(post);
}

template <class Sample>
Result<void> Poster<Sample>::post_once(std::string_view instance, std::string_view event,
                                       const plc_TimeLimit& limit) noexcept
  requires std::same_as<Sample, plc_EventPost>
{
  dds::copy_text(sample_.instance, instance);
  dds::copy_text(sample_.event, event);
  sample_.limit = limit;
  sample_.late_ack = true;
  const dds_return_t written = write(++last_sequence_);
  sample_.late_ack = false;
  sample_.limit = {};
  return dds::check_code(written, "cannot post an event");
}

template <class Sample>
bool Poster<Sample>::on_ack(const plc_EventAck& ack, TimePoint now) {
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
  // Posts that the one before took and did not do are repeated now.
  if (new_server) last_write_ = TimePoint{};
  if (unacknowledged_.size() == before) return false;
  last_progress_ = now;
  return true;
}

template <class Sample>
TimePoint Poster<Sample>::repeat(TimePoint now) {
  if (unacknowledged_.empty()) return now + kResend;
  const bool met = has_met_server();
  const TimePoint due = std::max(last_progress_, last_write_) + patience_until_repeated();
  const bool new_server = last_write_ == TimePoint{} || met;
  if (!new_server && now < due) return due;
  for (Unacknowledged& post : unacknowledged_) {
    if (write(post) != DDS_RETCODE_OK || !(new_server || answered_)) break;
  }
  answered_ = false;
  last_write_ = now;
  return now + patience_until_repeated();
}

template <class Sample>
bool Poster<Sample>::has_met_server() noexcept {
  if (!met_.look(way_.writer.get())) return false;
  heard_ = false;
  return true;
}

template <class Sample>
Duration Poster<Sample>::patience_until_repeated() const noexcept {
  return heard_ && has_space_ ? kResend : kFirstResend;
}

template <class Sample>
void Poster<Sample>::begin_report(TimePoint now) {
  unacknowledged_.clear();
  account_.begin(last_sequence_ + 1);
  last_progress_ = now;
}

template <class Sample>
PostReport Poster<Sample>::report() const {
  PostReport report = account_.report();
  report.unacknowledged = unacknowledged_.size();
  return report;
}

template class Poster<plc_EventPost>;
template class Poster<plc_EventBatch>;

}  // namespace plchost
