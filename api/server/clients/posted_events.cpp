#include "api/server/clients/posted_events.hpp"

#include <algorithm>
#include <utility>

namespace plchost {

void PostedEvents::Posts::add(std::string_view instance, std::string_view event, std::uint64_t count) {
  const auto known = std::ranges::find_if(
      events, [&](const Event& one) { return one.event == event && one.instance == instance; });
  if (known != events.end()) {
    known->count += count;
  } else if (events.size() < kEventsOfSource) {
    events.push_back({.instance = std::string(instance), .event = std::string(event), .count = count});
  } else {
    others += count;
  }
}

void PostedEvents::Posts::add(const Posts& more) {
  for (const Event& event : more.events) add(event.instance, event.event, event.count);
  others += more.others;
}

void PostedEvents::note(const dds::Guid& source, std::string_view instance, std::string_view event) {
  auto known = sources_.find(source);
  if (known == sources_.end()) {
    if (sources_.size() >= kSources) return;  // its number is told all the same
    known = sources_.try_emplace(source).first;
  }
  known->second.add(instance, event, 1);
}

PostedEvents::BySource PostedEvents::take() {
  return std::exchange(sources_, {});
}

}  // namespace plchost
