#include "api/client/seen_hosts.hpp"

#include "api/dds/text.hpp"

namespace plchost {

SeenHost* SeenHosts::find_or_add(std::string_view name, TimePoint now) {
  if (const auto known = hosts_.find(name); known != hosts_.end()) return &known->second;
  if (hosts_.size() >= kMost) {
    std::erase_if(hosts_, [now](const auto& entry) { return now - entry.second.last > kForgotten; });
  }
  if (hosts_.size() >= kMost) return nullptr;
  return &hosts_[std::string(name)];
}

bool SeenHosts::take(const plc_Presence& presence, TimePoint now) {
  SeenHost* const seen = find_or_add(dds::text_of(presence.host), now);
  if (seen == nullptr) return false;
  const bool is_gone = now - seen->last > kServerGone;
  // The last word of a server that was replaced; or another host that has the same name.
  if (presence.epoch < seen->epoch && !is_gone) {
    seen->others = now - seen->other_last > kServerGone ? 1 : seen->others + 1;
    seen->other_last = now;
    return false;
  }
  const bool is_news = seen->epoch != presence.epoch || is_gone;
  seen->epoch = presence.epoch;
  seen->pid = presence.pid;
  seen->last = now;
  seen->clock.take(presence, now);
  return is_news;
}

const SeenHost* SeenHosts::find(std::string_view name) const {
  const auto known = hosts_.find(name);
  return known == hosts_.end() ? nullptr : &known->second;
}

}  // namespace plchost
