#include "api/client/seen_hosts.hpp"

#include <algorithm>

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

bool SeenHosts::take(const plc_Presence& presence, TimePoint now, dds_instance_handle_t writer) {
  SeenHost* const seen = find_or_add(dds::text_of(presence.host), now);
  if (seen == nullptr) return false;
  const bool is_gone = now - seen->last > kServerGone;
  // The last word of a server that was replaced; or another host that has the same name.
  if (presence.epoch < seen->epoch && !is_gone) {
    seen->others = now - seen->other_last > kServerGone ? 1 : seen->others + 1;
    seen->other_last = now;
    for (Replaced& before : replaced_) {
      if (before.writer == writer) before.last = now;
    }
    return false;
  }
  if (seen->writer != writer) {
    std::erase_if(replaced_, [writer](const Replaced& before) { return before.writer == writer; });
    if (seen->writer != DDS_HANDLE_NIL && replaced_.size() < kMostReplaced) {
      replaced_.push_back({.writer = seen->writer, .last = seen->last});
    }
    seen->writer = writer;
  }
  const bool is_news = seen->epoch != presence.epoch || is_gone;
  seen->epoch = presence.epoch;
  seen->pid = presence.pid;
  seen->last = now;
  seen->clock.take(presence, now);
  return is_news;
}

std::vector<dds_instance_handle_t> SeenHosts::take_ended(TimePoint now) {
  std::vector<dds_instance_handle_t> ended;
  std::erase_if(replaced_, [&](const Replaced& before) {
    const bool has_ended = now - before.last >= kEnded;
    if (has_ended) ended.push_back(before.writer);
    return has_ended;
  });
  return ended;
}

const SeenHost* SeenHosts::find(std::string_view name) const {
  const auto known = hosts_.find(name);
  return known == hosts_.end() ? nullptr : &known->second;
}

}  // namespace plchost
