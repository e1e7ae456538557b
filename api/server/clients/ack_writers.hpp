#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <control.h>

#include "api/dds/guid.hpp"

namespace plchost {

/// The writers of acknowledgements, by the participant of the client, for the thread that receives posts.
/// That thread writes them by itself: to hand them to another one would take longer than all else that is
/// done for a post. It may do so within DDS's listener because these writers keep one sample for each source
/// and so never wait for a reader. Any thread.
///
/// DDS keeps the last acknowledgement of each source for readers that come late. Of more than kMostSources of
/// one client, the one that posted least recently is unregistered. So a client that makes a writer for each
/// post takes no more memory than others.
class AckWriters {
 public:
  static constexpr std::size_t kMostSources = 64;

  explicit AckWriters(std::string host) : host_(std::move(host)) {}

  void add(const dds::Guid& client, dds_entity_t writer);
  /// Before the writer is deleted: none uses it any more when this returns. Its sources are unregistered.
  void remove(const dds::Guid& client);

  /// False: there is no writer (yet), or DDS did not take it.
  [[nodiscard]] bool write(const dds::Guid& client, const plc_EventAck& ack);

 private:
  struct Source {
    dds::Guid guid;
    std::uint64_t last_use = 0;
  };
  struct Writer {
    dds_entity_t entity = 0;
    std::vector<Source> sources = {};
  };
  void use(Writer& writer, const dds::Guid& source);
  void unregister(dds_entity_t writer, const dds::Guid& source) const;

  const std::string host_;
  std::mutex mutex_;
  std::unordered_map<dds::Guid, Writer, dds::GuidHash> writers_;
  std::uint64_t uses_ = 0;
};

}  // namespace plchost
