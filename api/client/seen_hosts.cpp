#include "api/client/seen_hosts.hpp"

#include <algorithm>

#include "api/dds/text.hpp"

namespace plchost {

SeenHost* SeenHosts::find_or_add(std::string_view name, TimePoint now) {
  if (const auto known = hosts_.find(name); known != hosts_.end()) return &known->second;
  if (hosts_.size() >= kMost) {
    std::erase_if(hosts_, [now](const auto& entry) { return now - entry.second.server.last() > kForgotten; });
  }
  if (hosts_.size() >= kMost) return nullptr;
  return &hosts_[std::string(name)];
}

bool SeenHosts::take(const plc_Presence& presence, TimePoint now, dds_instance_handle_t writer) {
  SeenHost* const seen = find_or_add(dds::text_of(presence.host), now);
  if (seen == nullptr) return false;
  const NewestEpoch before = seen->server;
  // The last word of a server that was replaced; or another host that has the same name.
  if (!seen->server.accept(presence.epoch, now)) {
    seen->others = now - seen->other_last > kServerGone ? 1 : seen->others + 1;
    seen->other_last = now;
    for (Replaced& replaced : replaced_) {
      if (replaced.writer == writer) replaced.last = now;
    }
    return false;
  }
  if (seen->writer != writer) {
    std::erase_if(replaced_, [writer](const Replaced& replaced) { return replaced.writer == writer; });
    if (seen->writer != DDS_HANDLE_NIL && replaced_.size() < kMostReplaced) {
      replaced_.push_back({.writer = seen->writer, .last = before.last()});
    }
    seen->writer = writer;
  }
  seen->pid = presence.pid;
  seen->clock.take(presence, now);
  return before.value() != presence.epoch || before.is_gone(now);
}

std::vector<dds_instance_handle_t> SeenHosts::take_ended(TimePoint now) {
  std::vector<dds_instance_handle_t> ended;
  std::erase_if(replaced_, [&](const Replaced& replaced) {
    const bool has_ended = now - replaced.last >= kEnded;
    if (has_ended) ended.push_back(replaced.writer);
    return has_ended;
  });
  return ended;
}

const SeenHost* SeenHosts::find(std::string_view name) const {
  const auto known = hosts_.find(name);
  return known == hosts_.end() ? nullptr : &known->second;
}

}  // namespace plchost
