#include "shm/block_driver/duplicate_filter.hpp"

#include <algorithm>

namespace plchost {

DuplicateFilter::Source& DuplicateFilter::source_of(const BlockHeader& header) noexcept {
  const auto is_it = [&](const Source& source) {
    return source.address == header.source && source.priority == header.priority;
  };
  const auto known = std::ranges::find_if(sources_, is_it);
  // Without a match the one that was silent for longest, which a free one is.
  Source& source = known != sources_.end() ? *known : *std::ranges::min_element(sources_, {}, &Source::used);
  // A source that began anew counts from 0 again.
  if (!is_it(source) || source.epoch != header.epoch) {
    source = {.address = header.source,
              .priority = header.priority,
              .epoch = header.epoch,
              .newest = header.sequence,
              .seen = 0,
              .used = 0};
  }
  source.used = ++turn_;
  return source;
}

bool DuplicateFilter::first_time(const BlockHeader& header) noexcept {
  Source& source = source_of(header);
  const auto ahead = static_cast<std::int32_t>(header.sequence - source.newest);
  if (ahead > 0) {
    const auto step = static_cast<std::uint32_t>(ahead);
    source.seen = step < kWindow ? source.seen << step : 0;
    source.newest = header.sequence;
  }
  const std::uint32_t behind = source.newest - header.sequence;
  if (behind >= kWindow) return false;
  const std::uint64_t bit = std::uint64_t{1} << behind;
  const bool first = (source.seen & bit) == 0;
  source.seen |= bit;
  return first;
}

}  // namespace plchost
