#include "api/server/clients/ack_writers.hpp"

#include <algorithm>

#include "api/dds/instances.hpp"
#include "api/dds/text.hpp"

namespace plchost {

void AckWriters::add(const dds::Guid& client, dds_entity_t writer) {
  const std::lock_guard lock(mutex_);
  writers_[client] = {.entity = writer};
}

void AckWriters::remove(const dds::Guid& client) {
  const std::lock_guard lock(mutex_);
  const auto removed = writers_.extract(client);
  if (removed.empty()) return;
  for (const Source& source : removed.mapped().sources) unregister(removed.mapped().entity, source.guid);
}

bool AckWriters::write(const dds::Guid& client, const plc_EventAck& ack) {
  const std::lock_guard lock(mutex_);
  const auto known = writers_.find(client);
  if (known == writers_.end()) return false;
  if (dds_write(known->second.entity, &ack) != DDS_RETCODE_OK) return false;
  use(known->second, dds::Guid::from(ack.source));
  return true;
}

void AckWriters::use(Writer& writer, const dds::Guid& source) {
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
  unregister(writer.entity, oldest.guid);
  oldest = {.guid = source, .last_use = uses_};
}

void AckWriters::unregister(dds_entity_t writer, const dds::Guid& source) const {
  plc_EventAck key{};
  source.copy_to(key.source);
  dds::copy_text(key.host, host_);
  dds::unregister_instance(writer, &key);
}

}  // namespace plchost
