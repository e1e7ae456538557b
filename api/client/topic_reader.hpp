#pragma once

#include <cstdint>

#include "api/client/wait_set.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

/// As dds::open_reader(), and `wait_set` waits for it: how clients and gateways open what hosts show.
[[nodiscard]] Result<dds::TopicReader> open_reader(dds_entity_t participant, dds_entity_t subscriber,
                                                   const dds::TopicInfo& topic, const dds::Qos& qos,
                                                   const WaitSet& wait_set,
                                                   std::uint32_t statuses = DDS_DATA_AVAILABLE_STATUS);

}  // namespace plchost
