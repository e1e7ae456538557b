#include "api/server/posts/ack_writers.hpp"

#include <algorithm>

namespace plchost {

void AckWriters::add(const dds::Guid& client, dds_entity_t writer) {
  const std::lock_guard lock(mutex_);
  writers_[client] = {.entity = writer};
}

void AckWriters::remove(const dds::Guid& client) {
  const std::lock_guard lock(mutex_);
  writers_.erase(client);
}

bool AckWriters::write(const dds::Guid& client, const plc_EventAck& ack) {
  const std::lock_guard lock(mutex_);
  const auto known = writers_.find(client);
  if (known == writers_.end()) return false;
  use(known->second, ack);
  return dds_write(known->second.entity, &ack) == DDS_RETCODE_OK;
}

void AckWriters::use(Writer& writer, const plc_EventAck& ack) {
  const dds::Guid source = dds::Guid::from(ack.source);
  ++uses_;
  if (const auto known = std::ranges::find(writer.sources, source, &Source::guid);
      known != writer.sources.end()) {
    known->last_use = uses_;
    return;
  }
  if (writer.sources.size() < kMostSources) {
    writer.sources.push_back({.guid = source, .last_use = uses_});
    return;
  }
  Source& oldest = *std::ranges::min_element(writer.sources, {}, &Source::last_use);
  plc_EventAck key = ack;  // the host is the same
  oldest.guid.copy_to(key.source);
  (void)dds_unregister_instance(writer.entity, &key);
  oldest = {.guid = source, .last_use = uses_};
}

}  // namespace plchost
