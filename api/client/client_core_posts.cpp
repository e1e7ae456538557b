#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/client_core.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"
#include "shm/base/futex.hpp"

namespace plchost {

template <class Sample>
Result<Poster<Sample>*> ClientCore::poster(const std::string& host) {
  auto& [topic, of_host] = std::get<Posters<Sample>>(posters_);
  if (const auto known = of_host.find(host); known != of_host.end()) return &known->second;
  const dds::Qos qos = dds::qos_of(dds::kEventAck);  // the latest one of each source
  PLCHOST_TRY(open_own_reader<plc_EventAck>(acks_, qos));
  if (!topic) {
    PLCHOST_TRY_ASSIGN(topic, dds::make_topic(entity(), dds::kTopicOf<Sample>));
  }
  PLCHOST_TRY_ASSIGN(auto made, Poster<Sample>::create(entity(), topic.get(), host));
  PLCHOST_TRY(pump_->set().add(made.writer(), DDS_PUBLICATION_MATCHED_STATUS));
  own_answers_.add(made.source());
  return &of_host.emplace(host, std::move(made)).first->second;
}
template Result<EventPoster*> ClientCore::poster<plc_EventPost>(const std::string& host);

void ClientCore::use_clock(EventPoster& posts, const std::string& host, Duration patience) const {
  if (const HostClock* const clock = clock_of(host)) posts.wait_for(patience, *clock);
}

Async<std::unique_ptr<Turns::Turn>> ClientCore::turn_to_post(std::string host, TimePoint deadline) {
  auto turn = std::make_unique<Turns::Turn>(posting_[host], *pump_);
  while (!turn->has_come()) {
    if (MonotonicClock::now() >= deadline) co_return nullptr;
    co_await turn->come(deadline);
  }
  co_return turn;
}

Async<Result<void>> ClientCore::prepare_posts(std::string host, TimePoint deadline) {
  PLCHOST_CO_TRY(check_host_name(host, only_));
  PLCHOST_CO_TRY_ASSIGN(EventPoster* const way, poster<plc_EventPost>(host));
  update_hosts();  // the limit is by the newest presence
  pump_->look_again();
  while (!way->matched() || clock_of(host) == nullptr) {
    if (MonotonicClock::now() >= deadline) {
      co_return failure(ErrorCode::timed_out, fmt::format("host '{}' takes no events", host));
    }
    co_await pump_->change(deadline);
  }
  co_return Result<void>();
}

bool ClientCore::take_acks(TimePoint now) {
  bool progress = false;
  if (!acks_) return false;
  dds::take_valid_told<plc_EventAck>(acks_.reader.get(), answering_,
                                     [&](const plc_EventAck& ack, const auto& /*info*/) {
                                       const auto tell = [&](auto& posters) {
                                         const auto way = posters.of_host.find(dds::text_of(ack.host));
                                         if (way != posters.of_host.end())
                                           progress |= way->second.on_ack(ack, now);
                                       };
                                       std::apply([&](auto&... each) { (tell(each), ...); }, posters_);
                                     });
  return progress;
}

Async<Result<PostReport>> ClientCore::post_event(HostEvent event, std::uint64_t count, Duration interval,
                                                 Duration patience, std::function<bool()> stop) {
  PLCHOST_CO_TRY(check_host_name(event.host, only_));
  PLCHOST_CO_TRY(check_event_name(event.instance, event.event));
  const auto turn = co_await turn_to_post(event.host, kNoDeadline);
  const TimePoint start = MonotonicClock::now();
  PLCHOST_CO_TRY(co_await prepare_posts(event.host, start + patience));
  PLCHOST_CO_TRY_ASSIGN(EventPoster* const way, poster<plc_EventPost>(event.host));
  EventPoster& posts = *way;
  (void)take_acks(start);  // of posts that were given up
  posts.begin_report(start);
  use_clock(posts, event.host, patience);
  const EventId id = event.id();
  const TimePoint first = MonotonicClock::now();
  std::uint64_t sent = 0;
  for (;;) {
    TimePoint now = MonotonicClock::now();
    use_clock(posts, event.host, patience);
    TimePoint next = kNoDeadline;
    if (stop && stop()) count = sent;
    while (sent < count && posts.has_room()) {
      next = first + interval * static_cast<Duration::rep>(sent);
      if (next > now) break;
      posts.post(id, now);
      ++sent;
      now = MonotonicClock::now();
    }
    if (posts.unacknowledged() == 0 && sent == count) co_return posts.report();
    if (posts.unacknowledged() > 0 && now - posts.last_progress() > patience && !take_acks(now)) {
      PostReport report = posts.report();
      report.unacknowledged += count - sent;
      co_return report;
    }
    constexpr Duration kStopLook = std::chrono::milliseconds(50);
    const TimePoint look = stop ? now + kStopLook : kNoDeadline;
    const TimePoint more = posts.has_room() && sent < count ? next : kNoDeadline;
    const TimePoint again = posts.repeat(now);
    const TimePoint until = std::min({more, again, look});
    co_await pump_->change(until);
  }
}

Async<Result<PostReport>> ClientCore::post_batch(std::string host, std::vector<EventId> events,
                                                 Duration patience) {
  PLCHOST_CO_TRY(check_host_name(host, only_));
  if (events.empty() || events.size() > kMaxBatch) {
    co_return failure(ErrorCode::invalid_argument,
                      fmt::format("a batch of {} events; allowed are 1 to {}", events.size(), kMaxBatch));
  }
  for (const EventId& event : events) {
    PLCHOST_CO_TRY(check_event_name(event.instance, event.event));
  }
  const auto turn = co_await turn_to_post(host, kNoDeadline);
  PLCHOST_CO_TRY_ASSIGN(BatchPoster* const way, poster<plc_EventBatch>(host));
  BatchPoster& posts = *way;
  const TimePoint deadline = MonotonicClock::now() + patience;
  update_hosts();  // the limit is by the newest presence
  pump_->look_again();
  for (bool posted = false;;) {
    const TimePoint now = MonotonicClock::now();
    const HostClock* const clock = clock_of(host);
    const bool begins = !posted && clock != nullptr && posts.matched();
    if (begins) posts.begin_report(now);
    if (clock != nullptr) posts.wait_for(deadline - posts.last_progress(), *clock);
    if (begins) posts.post(events, now);
    posted |= begins;
    if (posted && posts.unacknowledged() == 0) co_return posts.report();
    if (now >= deadline) break;
    const TimePoint again = posted ? posts.repeat(now) : deadline;
    co_await pump_->change(std::min(deadline, again));
  }
  co_return failure(ErrorCode::timed_out, fmt::format("host '{}' has not acknowledged the batch", host));
}

Result<void> ClientCore::post_one(const std::string& host, std::string_view instance, std::string_view event,
                                  Duration patience) {
  PLCHOST_TRY(check_event_name(instance, event));
  auto& posters = std::get<Posters<plc_EventPost>>(posters_).of_host;
  const auto way = posters.find(host);
  if (way == posters.end()) return failure(ErrorCode::wrong_state, "prepare_posts() comes first");
  // Before the post only where the clock is old: this is latency of the post.
  constexpr Duration kOld = 4 * dds::kPresencePeriod;
  const TimePoint now = MonotonicClock::now();
  if (now - hosts_look_ > kOld) update_hosts();
  const HostClock* const clock = clock_of(host);
  if (clock == nullptr) return failure(ErrorCode::unavailable, fmt::format("host '{}' is forgotten", host));
  auto posted = way->second.post_once(instance, event, clock->limit_at(now + patience));
  // Nobody else reads meanwhile that the host has a new server, so that the one before needs no room any
  // more.
  if (!posted || now - hosts_look_ > dds::kPresencePeriod) update_hosts();
  return posted;
}

}  // namespace plchost
