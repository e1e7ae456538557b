#include <algorithm>
#include <chrono>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/client_core.hpp"
#include "api/dds/ended_participant.h"
#include "api/dds/guid.hpp"
#include "api/dds/host_writers.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "api/dds/told_keys.h"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr Duration kToldKeysLook = std::chrono::seconds(1);

// The name of the answering host is a stranger's text.
std::string no_such_host(std::string_view name, const std::vector<std::string>& answering) {
  const std::vector<std::string_view> views(answering.begin(), answering.end());
  const std::string_view near = nearest_name(name, views);
  return fmt::format("no host '{}' answers{}; those that do: {}", name,
                     near.empty() || near == name ? "" : fmt::format(" (did you mean '{}'?)", shown(near)),
                     join_some(answering));
}

// "a,b" is a and b.
std::vector<std::string> split_list(std::string_view all) {
  std::vector<std::string> parts;
  for (std::string_view rest = all; !rest.empty();) {
    const std::size_t comma = rest.find(',');
    parts.emplace_back(rest.substr(0, comma));
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  }
  return parts;
}

}  // namespace

std::vector<std::string> HostView::labels() const {
  return split_list(dds::text_of(status.labels));
}

std::vector<std::string> HostView::schedulers() const {
  return split_list(dds::text_of(status.schedulers));
}

void ClientCore::update_hosts() {
  const TimePoint now = MonotonicClock::now();
  hosts_look_ = now;
  // None is kept beside what seen_ has of it: that is bounded.
  dds::take_valid_told<plc_Presence>(
      presence_.reader(), presence_.writers(), [&](const plc_Presence& presence, const auto& info) {
        const auto is_silent = [&] {
          const SeenHost* const seen = seen_.find(dds::text_of(presence.host));
          return seen != nullptr && now - seen->server.last() >= kSilent;
        };
        const bool was_silent = is_silent();
        const bool is_news = seen_.take(presence, now, info.publication_handle);
        if (is_news) last_news_ = now;
        // is_silent() may have said so although no changes() saw it.
        if (is_news || (was_silent && !is_silent())) ++host_changes_;
      });
  // Posts that a killed server has not acknowledged would hold up those to its successor.
  for (const dds_instance_handle_t writer : seen_.take_ended(now)) {
    (void)plc_forget_participant(presence_.reader(), writer);
  }
  // Each server that is started anew is told keys, which a server that stays would keep here.
  if (now - told_keys_look_ >= kToldKeysLook) {
    told_keys_look_ = now;
    (void)plc_forget_told_keys(presence_.reader());
  }
  host_status_.update();
  if (host_status_.size() <= SeenHosts::kMost) return;
  host_status_.erase_if(
      [this](const plc_HostStatus& status) { return seen_.find(dds::text_of(status.host)) == nullptr; });
}

std::optional<HostView> ClientCore::view_of(std::string_view name, const SeenHost& seen) const {
  const auto status = host_status_.of_host(name, seen.server.value());
  if (status.empty()) return std::nullopt;
  constexpr std::uint32_t kMoreThanLastWords = 3;
  const TimePoint now = MonotonicClock::now();
  HostView view{.name = std::string(name),
                .epoch = seen.server.value(),
                .server_pid = seen.pid,
                .status = status.front(),
                .ext = {},
                .silent = now - seen.server.last() >= kSilent,
                .contested = seen.others >= kMoreThanLastWords && now - seen.other_last <= kHostGone};
  const auto ext = dds::parts_of(view.status.ext);
  view.ext.assign(ext.begin(), ext.end());
  view.status.ext = {};
  return view;
}

std::optional<HostView> ClientCore::present(std::string_view name) const {
  const SeenHost* const seen = seen_.find(name);
  if (seen == nullptr || seen->server.is_gone(MonotonicClock::now())) return std::nullopt;
  return view_of(name, *seen);
}

std::vector<HostView> ClientCore::present() const {
  std::vector<HostView> found;
  for (const auto& [name, seen] : seen_.all()) {
    if (auto view = present(name)) found.push_back(std::move(*view));
  }
  return found;
}

bool ClientCore::is_silent(std::string_view host) {
  look();
  const SeenHost* const seen = seen_.find(host);
  return seen != nullptr && MonotonicClock::now() - seen->server.last() >= kSilent;
}

std::uint64_t ClientCore::changes() {
  look();
  const TimePoint now = MonotonicClock::now();
  std::vector<int> silences;
  for (const auto& [name, seen] : seen_.all()) {
    const bool silent = now - seen.server.last() >= kSilent;
    silences.push_back(static_cast<int>(silent) + static_cast<int>(seen.server.is_gone(now)));
  }
  if (silences != silences_) {
    silences_ = std::move(silences);
    ++host_changes_;
  }
  const std::uint64_t status =
      std::apply([](const auto&... cache) { return (cache.changes() + ...); }, status_);
  return host_changes_ + host_status_.changes() + status;
}

TimePoint ClientCore::next_silence() const {
  const TimePoint now = MonotonicClock::now();
  TimePoint next = TimePoint::max();
  for (const auto& [name, seen] : seen_.all()) {
    const TimePoint silent = seen.server.last() + kSilent;
    if (silent > now) next = std::min(next, silent);
  }
  return next;
}

// Of hosts that DDS has discovered, without what they show. One that has shown it and is silent is not late.
std::vector<dds_instance_handle_t> ClientCore::late_writers(const std::vector<HostView>& found) {
  std::vector<dds_instance_handle_t> late = dds::writers_of(presence_.reader());
  std::erase_if(late, [&](dds_instance_handle_t writer) {
    const std::string name = presence_.writers().host_behind(presence_.reader(), writer);
    if (name.empty() || std::ranges::binary_search(found, name, {}, &HostView::name)) return true;
    const SeenHost* const seen = seen_.find(name);
    return seen != nullptr && seen->writer == writer && seen->server.is_gone(MonotonicClock::now());
  });
  return late;
}

Async<std::vector<HostView>> ClientCore::hosts(TimePoint deadline) {
  const TimePoint began = MonotonicClock::now();
  const TimePoint half = began + (deadline - began) / 2;  // the rest is for what is asked of the host
  look();
  for (;;) {
    const TimePoint now = MonotonicClock::now();
    auto found = present();
    TimePoint settled = deadline;
    if (now >= deadline) co_return found;
    if (!found.empty()) {
      settled = std::max(last_news_ + quiet_, std::min(half, late_writers_.until(late_writers(found), now)));
    }
    if (now >= settled) co_return found;
    co_await pump_->change(std::min(settled, deadline));
  }
}

Async<Result<HostView>> ClientCore::host(std::string name, TimePoint deadline) {
  PLCHOST_CO_TRY(check_host_name(name, only_));
  const TimePoint began = MonotonicClock::now();
  look();
  for (;;) {
    if (auto found = present(name)) co_return *std::move(found);
    if (MonotonicClock::now() >= deadline) break;
    co_await pump_->change(deadline);
  }
  // The others send it nothing.
  if (!only_.empty()) {
    auto others = dds::discovered_hosts(entity());
    std::erase(others, name);  // it has just not answered
    co_return failure(ErrorCode::not_found, no_such_host(name, others));
  }
  // Those too that are late at this very moment.
  std::vector<std::string> names;
  for (const auto& [other, seen] : seen_.all()) {
    if (seen.server.last() >= began - kHostGone) names.push_back(other);
  }
  co_return failure(ErrorCode::not_found, no_such_host(name, names));
}

Async<std::vector<HostView>> ClientCore::known_hosts(TimePoint deadline) {
  co_await hosts(deadline);
  const auto is_in_doubt = [](const auto& entry) {
    const Duration silence = MonotonicClock::now() - entry.second.server.last();
    return silence >= kSilent && silence <= kHostGone;
  };
  // A moment of silence is not the end of a host.
  const TimePoint end = MonotonicClock::now() + 2 * kHostGone;
  while (std::ranges::any_of(seen_.all(), is_in_doubt) && MonotonicClock::now() < end) {
    co_await pump_->change(MonotonicClock::now() + dds::kPresencePeriod);
  }
  std::vector<HostView> found;
  for (const auto& [name, seen] : seen_.all()) {
    if (auto view = view_of(name, seen)) found.push_back(std::move(*view));
  }
  co_return found;
}

Async<Result<ClockOffset>> ClientCore::clock_offset(std::string host, TimePoint deadline) {
  constexpr int kTries = 5;
  std::optional<ClockOffset> best;
  const ApiRequest request{
      .host = host, .operation = plc_OPERATION_READ_CLOCK, .instance = "", .argument = ""};
  for (int i = 0; i < kTries; ++i) {
    const auto reply = co_await call(request, deadline);
    if (!reply && best) break;
    if (!reply) co_return std::unexpected(reply.error());
    if (reply->code != ErrorCode::ok) co_return failure(reply->code, reply->text);
    // It was written somewhere between.
    const std::int64_t way = reply->heard_unix_ns - reply->asked_unix_ns;
    const ClockOffset measured{.offset = Duration(reply->host_unix_ns - reply->asked_unix_ns - way / 2),
                               .uncertainty = Duration((way + 1) / 2)};
    if (!best || measured.uncertainty < best->uncertainty) best = measured;
  }
  co_return *best;
}

}  // namespace plchost
