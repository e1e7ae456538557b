#include "api/client/late_writers.hpp"

#include <algorithm>
#include <utility>

namespace plchost {

TimePoint LateWriters::until(std::span<const dds_instance_handle_t> late, TimePoint now) {
  std::map<dds_instance_handle_t, TimePoint> since;
  TimePoint end = TimePoint::min();
  for (const dds_instance_handle_t writer : late) {
    const auto known = since_.find(writer);
    const TimePoint first = known == since_.end() ? now : known->second;
    since.emplace(writer, first);
    end = std::max(end, first + kPatience);
  }
  since_ = std::move(since);
  return end;
}

}  // namespace plchost
