#pragma once

#include <string>
#include <string_view>

#include <control.h>

#include "api/dds/entity.hpp"
#include "api/dds/qos.hpp"
#include "shm/base/result.hpp"

namespace plchost::dds {

inline constexpr std::uint32_t kApiVersion = 1;

/// A topic of control.idl: its name and its type.
struct TopicInfo {
  const char* name;
  const dds_topic_descriptor_t* type;
};

inline constexpr TopicInfo kOperatorRequest{"plc/v1/op/request", &plc_Request_desc};
inline constexpr TopicInfo kEngineerRequest{"plc/v1/eng/request", &plc_Request_desc};
inline constexpr TopicInfo kReply{"plc/v1/reply", &plc_Reply_desc};
inline constexpr TopicInfo kEvent{"plc/v1/event", &plc_EventPost_desc};
inline constexpr TopicInfo kEventBatch{"plc/v1/event_batch", &plc_EventBatch_desc};
inline constexpr TopicInfo kEventRun{"plc/v1/event_run", &plc_EventRun_desc};
inline constexpr TopicInfo kEventAck{"plc/v1/event_ack", &plc_EventAck_desc};
inline constexpr TopicInfo kPresence{"plc/v1/presence", &plc_Presence_desc};
inline constexpr TopicInfo kHostStatus{"plc/v1/status/host", &plc_HostStatus_desc};
inline constexpr TopicInfo kInstanceStatus{"plc/v1/status/instance", &plc_InstanceStatus_desc};
inline constexpr TopicInfo kTaskStatus{"plc/v1/status/task", &plc_TaskStatus_desc};
inline constexpr TopicInfo kTaskStatistics{"plc/v1/status/task_statistics", &plc_TaskStatistics_desc};
inline constexpr TopicInfo kEventStatus{"plc/v1/status/event", &plc_EventStatus_desc};
inline constexpr TopicInfo kObjectStatus{"plc/v1/status/object", &plc_ObjectStatus_desc};
inline constexpr TopicInfo kWriterStatus{"plc/v1/status/writer", &plc_WriterStatus_desc};
inline constexpr TopicInfo kApplicationStatus{"plc/v1/status/application", &plc_ApplicationStatus_desc};
inline constexpr TopicInfo kDownloadChunk{"plc/v1/eng/download_chunk", &plc_DownloadChunk_desc};
inline constexpr TopicInfo kDownloadAck{"plc/v1/download_ack", &plc_DownloadAck_desc};
inline constexpr TopicInfo kObjectPage{"plc/v1/objects", &plc_ObjectPage_desc};
inline constexpr TopicInfo kNodePage{"plc/v1/nodes", &plc_NodePage_desc};
inline constexpr TopicInfo kLogPage{"plc/v1/log", &plc_LogPage_desc};
inline constexpr TopicInfo kBlockHostStatus{"plc/v1/status/block_host", &plc_BlockHostStatus_desc};
inline constexpr TopicInfo kBlock{"plc/v1/blocks", &plc_Block_desc};
inline constexpr TopicInfo kBlockAck{"plc/v1/block_ack", &plc_BlockAck_desc};
inline constexpr TopicInfo kNameClaim{"plc/v1/name_claim", &plc_NameClaim_desc};
inline constexpr TopicInfo kHostFinding{"plc/v1/status/host_finding", &plc_HostFinding_desc};
inline constexpr TopicInfo kExceptionStatus{"plc/v1/status/exception", &plc_ExceptionStatus_desc};
inline constexpr TopicInfo kTransition{"plc/v1/transition", &plc_Transition_desc};

/// The bounds of the readers and histories. A reader that is full makes the writer wait: back-pressure, no
/// loss.
inline constexpr std::int32_t kRequestReaderDepth = 256;
inline constexpr std::int32_t kEventReaderDepth = 4096;
inline constexpr std::int32_t kBatchReaderDepth = 256;
inline constexpr std::int32_t kChunkReaderDepth = 64;
inline constexpr std::int32_t kRunDepth = 64;
inline constexpr std::int32_t kBlockReaderDepth = 1024;
inline constexpr std::int32_t kReplyDepth = 16;
/// Samples of one key that a client has not taken yet: one of the host itself, and others that have no right
/// to it.
inline constexpr std::int32_t kStatusReaderDepth = 8;
inline constexpr std::int32_t kPageDepth = 4;         ///< of objects, of nodes, and of logs
inline constexpr std::int32_t kTransitionDepth = 64;  ///< of each instance; as many as its ring holds
/// Entry of InstanceStatus.ext: the number of the last transition of this instance that its host has written;
/// 0: none yet.
inline constexpr std::string_view kTransitionsEntry = "transitions";
/// Entry of HostStatus.ext: its labels, with commas between.
inline constexpr std::string_view kLabelsEntry = "labels";
/// More of them: see control.idl.
inline constexpr std::string_view kRunningEntry = "running";
inline constexpr std::string_view kSecuredEntry = "secured";
inline constexpr std::string_view kLoadEntry = "load";
inline constexpr std::string_view kCoresEntry = "cores";
inline constexpr std::string_view kMemoryEntry = "memory_mib";
inline constexpr std::string_view kAvailableEntry = "available_mib";
inline constexpr std::string_view kRivalEntry = "rival";
inline constexpr std::string_view kUnsavedEntry = "unsaved";
inline constexpr std::string_view kUnrecordedEntry = "unrecorded";
/// Entry of EventPost.ext and its value: an EventRun is wanted.
inline constexpr std::string_view kWaitEntry = "wait";
inline constexpr std::string_view kWaitForRun = "run";
/// Another one: nobody waits for the acknowledgement.
inline constexpr std::string_view kAckEntry = "ack";
inline constexpr std::string_view kAckLate = "late";
/// The largest piece of a download: as in control.idl.
inline constexpr std::size_t kMaxChunk = 32768;
/// No writer of the server waits longer.
inline constexpr Duration kServerBlocking = std::chrono::milliseconds(1);
inline constexpr Duration kRequestBlocking = std::chrono::milliseconds(100);
inline constexpr Duration kEventBlocking = std::chrono::milliseconds(20);
inline constexpr Duration kPresencePeriod = std::chrono::milliseconds(25);
inline constexpr Duration kPresenceDeadline = std::chrono::milliseconds(75);

[[nodiscard]] Qos request_qos();
[[nodiscard]] Qos event_qos();
[[nodiscard]] Qos reply_qos();
[[nodiscard]] Qos page_qos();
[[nodiscard]] Qos ack_qos();
[[nodiscard]] Qos run_qos();
[[nodiscard]] Qos status_qos();
[[nodiscard]] Qos presence_qos();
[[nodiscard]] Qos transition_qos();
[[nodiscard]] Qos block_qos();

// Partitions. Each that a host writes into names that host, after the first '.' or the last '/' (no name has
// one): the permission of a host's identity allows no other. A reader that takes from all hosts says "*" for
// the host.

/// For the host that a reader takes from: all of them.
inline constexpr std::string_view kAllHosts = "*";
/// Where requests and posts for one host go.
[[nodiscard]] std::string host_partition(std::string_view host);
/// What a host tells all.
[[nodiscard]] std::string status_partition(std::string_view host);
/// What a host tells one client (its participant's GUID in hex).
[[nodiscard]] std::string client_partition(std::string_view guid_hex, std::string_view host);
/// Where hosts meet that claim the same name.
[[nodiscard]] std::string name_partition(std::string_view host);
/// Blocks, and acknowledgements of blocks, from one host to another.
[[nodiscard]] std::string block_partition(std::string_view to_host, std::string_view from_host);

[[nodiscard]] Result<Entity> make_topic(dds_entity_t participant, const TopicInfo& topic);
/// `parent`: a participant, or a publisher or subscriber that carries the partition.
[[nodiscard]] Result<Entity> make_writer(dds_entity_t parent, dds_entity_t topic, const Qos& qos);
[[nodiscard]] Result<Entity> make_reader(dds_entity_t parent, dds_entity_t topic, const Qos& qos);
[[nodiscard]] Result<Entity> make_publisher(dds_entity_t participant, const std::string& partition);
[[nodiscard]] Result<Entity> make_subscriber(dds_entity_t participant, const std::string& partition);

}  // namespace plchost::dds
