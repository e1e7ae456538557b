#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <control.h>
#include <status_topics.hpp>

#include "api/dds/text.hpp"

namespace plchost {

/// How many samples of that type its host says that there are. Nothing: a host that does not know this topic.
template <class Sample>
[[nodiscard]] std::optional<std::uint32_t> count_of(const plc_HostStatus& host) noexcept {
  static_assert(!dds::kCountedAs<Sample>.empty());
  for (const plc_TopicCount& count : std::span(host.counts)) {
    if (dds::text_of(count.topic) == dds::kCountedAs<Sample>) return count.samples;
  }
  return std::nullopt;
}

}  // namespace plchost
