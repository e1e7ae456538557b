#include "api/client/topic_reader.hpp"

#include <utility>

namespace plchost {

Result<dds::TopicReader> open_reader(dds_entity_t participant, dds_entity_t subscriber,
                                     const dds::TopicInfo& topic, const dds::Qos& qos,
                                     const WaitSet& wait_set, std::uint32_t statuses) {
  PLCHOST_TRY_ASSIGN(auto opened, dds::open_reader(participant, subscriber, topic, qos));
  PLCHOST_TRY(wait_set.add(opened.reader.get(), statuses));
  return opened;
}

}  // namespace plchost
