#pragma once

#include <mutex>
#include <unordered_map>

#include <control.h>

#include "api/dds/guid.hpp"

namespace plchost {

/// The writers of acknowledgements, by the participant of the client, for the thread that receives posts: it
/// writes them by itself, since handing them to another thread takes longer than all else that is done for a
/// post. It may do so within DDS's listener because these writers keep one sample for each source and so
/// never wait for a reader. Any thread.
class AckWriters {
 public:
  void add(const dds::Guid& client, dds_entity_t writer);
  /// Before the writer is deleted: none uses it any more when this returns.
  void remove(const dds::Guid& client);

  /// False: there is no writer (yet), or DDS did not take it.
  [[nodiscard]] bool write(const dds::Guid& client, const plc_EventAck& ack);

 private:
  std::mutex mutex_;
  std::unordered_map<dds::Guid, dds_entity_t, dds::GuidHash> writers_;
};

}  // namespace plchost
