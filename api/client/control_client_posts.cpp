#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client.hpp"
#include "api/dds/text.hpp"
#include "shm/base/futex.hpp"

namespace plchost {

template <class Sample>
Result<Poster<Sample>*> ControlClient::poster(const std::string& host) {
  auto& [topic, of_host] = std::get<Posters<Sample>>(posters_);
  if (const auto known = of_host.find(host); known != of_host.end()) return &known->second;
  const dds::Qos qos = dds::qos_of(dds::kEventAck);  // the latest one of each source
  PLCHOST_TRY(open_own_reader<plc_EventAck>(acks_, qos));
  if (!topic) {
    PLCHOST_TRY_ASSIGN(topic, dds::make_topic(entity(), dds::kTopicOf<Sample>));
  }
  PLCHOST_TRY_ASSIGN(auto made, Poster<Sample>::create(entity(), topic.get(), host));
  PLCHOST_TRY(wait_set_.add(made.writer(), DDS_PUBLICATION_MATCHED_STATUS));
  own_answers_.add(made.source());
  return &of_host.emplace(host, std::move(made)).first->second;
}
template Result<EventPoster*> ControlClient::poster<plc_EventPost>(const std::string& host);

void ControlClient::use_clock(EventPoster& posts, const std::string& host, Duration patience) const {
  if (const HostClock* const clock = clock_of(host)) posts.wait_for(patience, *clock);
}

Result<void> ControlClient::prepare_posts(const std::string& host, TimePoint deadline) {
  if (auto good = check_host_name(host, only_); !good) return good;
  PLCHOST_TRY_ASSIGN(const auto way, poster<plc_EventPost>(host));
  update_hosts();  // the limit is by the newest presence
  while (!way->matched() || clock_of(host) == nullptr) {
    if (MonotonicClock::now() >= deadline) {
      return failure(ErrorCode::timed_out, fmt::format("host '{}' takes no events", host));
    }
    update();
    if (way->matched() && clock_of(host) != nullptr) break;
    wait_set_.wait(deadline);
  }
  return {};
}

bool ControlClient::take_acks(TimePoint now) {
  bool progress = false;
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

Result<PostReport> ControlClient::post_event(const HostEvent& event, std::uint64_t count, Duration interval,
                                             Duration patience, const std::function<bool()>& stop) {
  PLCHOST_TRY(check_event_name(event.instance, event.event));
  const TimePoint start = MonotonicClock::now();
  PLCHOST_TRY(prepare_posts(event.host, start + patience));
  PLCHOST_TRY_ASSIGN(const auto way, poster<plc_EventPost>(event.host));
  EventPoster& posts = *way;
  (void)take_acks(start);  // of posts that were given up
  posts.begin_report(start);
  use_clock(posts, event.host, patience);
  const EventId id = event.id();
  const TimePoint first = MonotonicClock::now();
  std::uint64_t sent = 0;
  for (bool woken = false;; woken = true) {
    TimePoint now = MonotonicClock::now();
    // Other topics are looked at when it was no acknowledgement that has woken this: nothing stands between
    // one and the next post, or the end.
    if (!take_acks(now) && woken) {
      update();
      use_clock(posts, event.host, patience);
    }
    TimePoint next = kNoDeadline;
    if (stop && stop()) count = sent;
    while (sent < count && posts.has_room()) {
      next = first + interval * static_cast<Duration::rep>(sent);
      if (next > now) break;
      posts.post(id, now);
      ++sent;
      now = MonotonicClock::now();
    }
    if (posts.unacknowledged() == 0 && sent == count) return posts.report();
    if (posts.unacknowledged() > 0 && now - posts.last_progress() > patience) {
      PostReport report = posts.report();
      report.unacknowledged += count - sent;
      return report;
    }
    constexpr Duration kStopLook = std::chrono::milliseconds(50);
    const TimePoint look = stop ? now + kStopLook : kNoDeadline;
    wait_set_.wait(
        std::min({posts.has_room() && sent < count ? next : kNoDeadline, posts.repeat(now), look}));
  }
}

Result<PostReport> ControlClient::post_batch(const std::string& host, std::span<const EventId> events,
                                             Duration patience) {
  PLCHOST_TRY(check_host_name(host, only_));
  if (events.empty() || events.size() > kMaxBatch) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("a batch of {} events; allowed are 1 to {}", events.size(), kMaxBatch));
  }
  for (const EventId& event : events) {
    PLCHOST_TRY(check_event_name(event.instance, event.event));
  }
  PLCHOST_TRY_ASSIGN(const auto way, poster<plc_EventBatch>(host));
  BatchPoster& posts = *way;
  const TimePoint deadline = MonotonicClock::now() + patience;
  update_hosts();  // the limit is by the newest presence
  for (bool posted = false;;) {
    const TimePoint now = MonotonicClock::now();
    (void)take_acks(now);
    const HostClock* const clock = clock_of(host);
    const bool begins = !posted && clock != nullptr && posts.matched();
    if (begins) posts.begin_report(now);
    if (clock != nullptr) posts.wait_for(deadline - posts.last_progress(), *clock);
    if (begins) posts.post(events, now);
    posted |= begins;
    if (posted && posts.unacknowledged() == 0) return posts.report();
    if (now >= deadline) break;
    update();
    wait_set_.wait(std::min(deadline, posted ? posts.repeat(now) : deadline));
  }
  return failure(ErrorCode::timed_out, fmt::format("host '{}' has not acknowledged the batch", host));
}

Result<void> ControlClient::post_one(const std::string& host, std::string_view instance,
                                     std::string_view event) {
  if (auto good = check_event_name(instance, event); !good) return good;
  auto& posters = std::get<Posters<plc_EventPost>>(posters_).of_host;
  const auto way = posters.find(host);
  if (way == posters.end()) return failure(ErrorCode::wrong_state, "prepare_posts() comes first");
  auto posted = way->second.post_once(instance, event);
  // Nobody else reads meanwhile that the host has a new server, so that the one before needs no room any
  // more.
  if (!posted) update_hosts();
  return posted;
}

}  // namespace plchost
