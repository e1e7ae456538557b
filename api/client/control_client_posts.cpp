#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client.hpp"
#include "api/dds/text.hpp"
#include "shm/base/futex.hpp"

namespace plchost {

Result<EventPoster*> ControlClient::poster(const std::string& host) {
  if (const auto known = posters_.find(host); known != posters_.end()) return &known->second;
  if (auto opened = open_own_reader(ack_topic_, ack_reader_, dds::kEventAck, dds::qos_of(dds::kEventAck));
      !opened) {
    return std::unexpected(opened.error());
  }
  if (!event_topic_) {
    auto made = dds::make_topic(entity(), dds::kEventPost);
    if (!made) return std::unexpected(made.error());
    event_topic_ = std::move(*made);
  }
  auto made = EventPoster::create(entity(), event_topic_.get(), host);
  if (!made) return std::unexpected(made.error());
  if (auto added = wait_set_.add(made->writer(), DDS_PUBLICATION_MATCHED_STATUS); !added) {
    return std::unexpected(added.error());
  }
  return &posters_.emplace(host, std::move(*made)).first->second;
}

void ControlClient::use_clock(EventPoster& posts, const std::string& host, Duration patience) const {
  if (const HostClock* const clock = clock_of(host)) posts.wait_for(patience, *clock);
}

Result<void> ControlClient::prepare_posts(const std::string& host, TimePoint deadline) {
  if (auto good = check_host_name(host); !good) return good;
  const auto way = poster(host);
  if (!way) return std::unexpected(way.error());
  update_hosts();  // the limit is by the newest presence
  while (!(*way)->matched() || clock_of(host) == nullptr) {
    if (MonotonicClock::now() >= deadline) {
      return failure(ErrorCode::timed_out, fmt::format("host '{}' takes no events", host));
    }
    update();
    wait_set_.wait(deadline);
  }
  return {};
}

bool ControlClient::take_acks(TimePoint now) {
  bool progress = false;
  dds::take_valid_told<plc_EventAck>(
      ack_reader_.get(), answering_, [&](const plc_EventAck& ack, const auto& /*info*/) {
        const auto host = dds::text_of(ack.host);
        if (const auto way = posters_.find(host); way != posters_.end())
          progress |= way->second.on_ack(ack, now);
        if (const auto way = batch_posters_.find(host); way != batch_posters_.end())
          way->second.on_ack(ack, now);
      });
  return progress;
}

Result<PostReport> ControlClient::post_event(const ApiRequest& event, std::uint64_t count, Duration interval,
                                             Duration patience, const std::function<bool()>& stop) {
  if (auto good = check_event_name(event.instance, event.argument); !good) {
    return std::unexpected(std::move(good).error());
  }
  const TimePoint start = MonotonicClock::now();
  if (auto ready = prepare_posts(event.host, start + patience); !ready) return std::unexpected(ready.error());
  const auto way = poster(event.host);
  if (!way) return std::unexpected(way.error());
  EventPoster& posts = **way;
  posts.begin_report(start);
  use_clock(posts, event.host, patience);
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
      posts.post(event.instance, event.argument, now);
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

Result<void> ControlClient::post_one(const std::string& host, std::string_view instance,
                                     std::string_view event) {
  if (auto good = check_event_name(instance, event); !good) return good;
  const auto way = posters_.find(host);
  if (way == posters_.end()) return failure(ErrorCode::wrong_state, "prepare_posts() comes first");
  auto posted = way->second.post_once(instance, event);
  // Nobody else reads meanwhile that the host has a new server, so that the one before needs no room any
  // more.
  if (!posted) update_hosts();
  return posted;
}

}  // namespace plchost
