#pragma once

#include <string>
#include <string_view>

#include <contract_bounds.hpp>
#include <control.h>
#include <topic_table.hpp>

#include "api/dds/entity.hpp"
#include "api/dds/qos.hpp"
#include "api/dds/topic_info.hpp"
#include "shm/base/result.hpp"

namespace plchost::dds {

inline constexpr std::uint32_t kApiVersion = 1;

/// The largest piece of a download.
inline constexpr std::size_t kMaxChunk = bounds::DownloadChunk::contents;
inline constexpr Duration kPresencePeriod = std::chrono::milliseconds(25);
inline constexpr Duration kPresenceDeadline = kPresence.qos.deadline;

/// Of a topic's writers, and of readers that need no bound of their own.
[[nodiscard]] Qos qos_of(const TopicInfo& topic);
/// For a reader of what hosts show: it keeps more of each key than the topic says. Samples of another host
/// under that key must not push out what has not been taken yet.
[[nodiscard]] Qos shown_qos(const TopicInfo& topic);
/// Of the reader of a host, with its bound: one that is full makes the writer wait. Back-pressure, no loss.
[[nodiscard]] Qos bounded_qos(const TopicInfo& topic);
/// Of a client's reader of what hosts answer: holds `each` samples of each host of a machine.
[[nodiscard]] Qos answers_qos(const TopicInfo& topic, std::int32_t each);

// Partitions. Each that a host writes into names that host, after the first '.' or the last '/' (no name has
// one): the permission of a host's identity allows no other. A reader that takes from all hosts says "*" for
// the host.

/// For the host that a reader takes from: all of them.
inline constexpr std::string_view kAllHosts = "*";
/// Where requests and posts for one host go.
[[nodiscard]] std::string host_partition(std::string_view host);
/// The topics of a host for all.
[[nodiscard]] std::string status_partition(std::string_view host);
/// The topics of a host for one client (its participant's GUID in hex).
[[nodiscard]] std::string client_partition(std::string_view guid_hex, std::string_view host);
/// The partition of hosts that claim the same name.
[[nodiscard]] std::string name_partition(std::string_view host);
/// Blocks, and acknowledgements of blocks, from one host to another.
[[nodiscard]] std::string block_partition(std::string_view to_host, std::string_view from_host);

[[nodiscard]] Result<Entity> make_topic(dds_entity_t participant, const TopicInfo& topic);
/// `parent`: a participant, or a publisher or subscriber that carries the partition.
[[nodiscard]] Result<Entity> make_writer(dds_entity_t parent, dds_entity_t topic, const Qos& qos);
[[nodiscard]] Result<Entity> make_reader(dds_entity_t parent, dds_entity_t topic, const Qos& qos);
[[nodiscard]] Result<Entity> make_publisher(dds_entity_t participant, const std::string& partition);
[[nodiscard]] Result<Entity> make_subscriber(dds_entity_t participant, const std::string& partition);

/// A topic and a reader of it, which ends first.
struct TopicReader {
  Entity topic;
  Entity reader;

  [[nodiscard]] explicit operator bool() const noexcept { return static_cast<bool>(reader); }
};
[[nodiscard]] Result<TopicReader> open_reader(dds_entity_t participant, dds_entity_t subscriber,
                                              const TopicInfo& topic, const Qos& qos);

/// A topic and a writer of it, which ends first.
struct TopicWriter {
  Entity topic;
  Entity writer;
};
[[nodiscard]] Result<TopicWriter> open_writer(dds_entity_t participant, dds_entity_t publisher,
                                              const TopicInfo& topic);

/// A writer with a publisher of its own, which carries the partition; it ends first.
struct PartitionWriter {
  Entity publisher;
  Entity writer;
};
[[nodiscard]] Result<PartitionWriter> open_writer(dds_entity_t participant, const std::string& partition,
                                                  dds_entity_t topic, const Qos& qos);

}  // namespace plchost::dds
