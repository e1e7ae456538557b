#pragma once

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <vector>

#include <dds/dds.h>

#include "api/client/control_client.hpp"

namespace plchost {

/// The entities of DDS that belong to this one.
inline std::vector<dds_entity_t> children_of(dds_entity_t parent) {
  std::array<dds_entity_t, 64> children{};
  const dds_return_t count = dds_get_children(parent, children.data(), children.size());
  return {children.begin(), std::next(children.begin(), std::clamp<dds_return_t>(count, 0, children.size()))};
}

/// The readers of such samples, of all clients that share the participant of this one.
template <class Sample>
std::vector<dds_entity_t> readers_of(const ControlClient& client) {
  std::vector<dds_entity_t> readers;
  for (const dds_entity_t parent : children_of(client.participant()->entity.get())) {
    for (const dds_entity_t child : children_of(parent)) {
      std::array<char, 64> topic{};
      (void)dds_get_name(dds_get_topic(child), topic.data(), topic.size());
      dds_subscription_matched_status_t matched{};
      if (std::string_view(topic.data()) == dds::kTopicOf<Sample>.name &&
          dds_get_subscription_matched_status(child, &matched) == DDS_RETCODE_OK)
        readers.push_back(child);
    }
  }
  return readers;
}

}  // namespace plchost
