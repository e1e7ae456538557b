#include "api/server/posts/ack_writers.hpp"

namespace plchost {

void AckWriters::add(const dds::Guid& client, dds_entity_t writer) {
  const std::lock_guard lock(mutex_);
  writers_[client] = writer;
}

void AckWriters::remove(const dds::Guid& client) {
  const std::lock_guard lock(mutex_);
  writers_.erase(client);
}

bool AckWriters::write(const dds::Guid& client, const plc_EventAck& ack) {
  const std::lock_guard lock(mutex_);
  const auto known = writers_.find(client);
  return known != writers_.end() && dds_write(known->second, &ack) == DDS_RETCODE_OK;
}

}  // namespace plchost
