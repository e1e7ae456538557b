#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include <control.h>

#include "api/dds/entity.hpp"
#include "api/dds/entity_reaper.hpp"
#include "api/dds/guid.hpp"
#include "api/server/clients/ack_writers.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The clients that were heard of, each with writers of its own in its own partition, so that one that does
/// not read holds up nobody else. Control loop only.
class SessionTable {
 public:
  static constexpr std::size_t kMaxSessions = 256;
  /// When there are more, one that got nothing for so long makes room: it is made again when that client asks
  /// again.
  static constexpr Duration kIdle = std::chrono::seconds(10);

  [[nodiscard]] static Result<SessionTable> create(dds_entity_t participant, std::string host);

  /// Follows which clients came (their reply or acknowledgement reader was discovered) and went.
  /// Returns how many participants have come or gone.
  [[nodiscard]] std::uint64_t follow_discovery();

  /// `client` is a participant. Answers without a session, because the table is full of clients that are all
  /// busy, are dropped and counted.
  /// False: the client cannot be answered, so its request is not executed. The client is not idle.
  [[nodiscard]] bool serves(const dds::Guid& client) { return session_of(client) != nullptr; }
  void write_reply(const dds::Guid& client, const plc_Reply& reply);
  void write_ack(const dds::Guid& client, const plc_EventAck& ack);
  /// Those of the clients whose acknowledgement reader was discovered: any thread, as long as this exists.
  [[nodiscard]] AckWriters& ack_writers() noexcept { return *ack_writers_; }
  /// By one of them: the client is not idle.
  void was_answered(const dds::Guid& client, TimePoint now);
  void write_run(const dds::Guid& client, const plc_EventRun& run);
  void write_ack(const dds::Guid& client, const plc_DownloadAck& ack);
  /// False: the client has not got it, nor will.
  [[nodiscard]] bool write_page(const dds::Guid& client, const plc_ObjectPage& page);
  [[nodiscard]] bool write_page(const dds::Guid& client, const plc_NodePage& page);
  [[nodiscard]] bool write_page(const dds::Guid& client, const plc_LogPage& page);
  [[nodiscard]] bool write_page(const dds::Guid& client, const plc_VariablePage& page);
  [[nodiscard]] bool write_page(const dds::Guid& client, const plc_DebugPage& page);
  [[nodiscard]] bool write_page(const dds::Guid& client, const plc_TracePage& page);

  /// The client's own words about itself, and its GUID.
  [[nodiscard]] std::string describe(const dds::Guid& client) const;
  /// Whether that participant is in the domain.
  [[nodiscard]] bool is_alive(const dds::Guid& client) const { return alive_.contains(client); }

  /// All that are in the domain, as follow_discovery() has found them; this process is one.
  [[nodiscard]] std::vector<dds::Guid> participants() const;

  [[nodiscard]] std::size_t size() const noexcept { return sessions_.size(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }
  /// The readers that follow_discovery() looks at, to be listened to.
  [[nodiscard]] std::vector<dds_entity_t> discovery_readers() const;

 private:
  /// The topics to each client, over a writer of its own.
  enum class Stream : std::uint8_t {
    replies,
    acks,
    objects,
    nodes,
    logs,
    runs,
    downloads,
    variables,
    debug,
    traces
  };
  static constexpr std::size_t kStreams = 10;
  struct Session {
    dds::Entity publisher;
    std::array<dds::Entity, kStreams> writers = {};
    TimePoint used = {};
  };

  SessionTable() = default;
  std::uint64_t follow_participants();
  void follow_readers();
  /// Made if it is not there. None for a client that is not (or no longer) in the domain.
  [[nodiscard]] Session* session_of(const dds::Guid& client);
  bool make_room(TimePoint now);
  void end_session(const dds::Guid& client);
  bool open_writer(const dds::Guid& client, Session& session, Stream stream);
  bool write(const dds::Guid& client, Stream stream, const void* sample);

  std::unique_ptr<dds::EntityReaper> reaper_;
  dds_entity_t participant_ = 0;
  std::string host_;
  std::array<dds::Entity, kStreams> topics_;
  dds::Entity participants_;
  dds::Entity subscriptions_;
  std::unordered_map<dds::Guid, std::string, dds::GuidHash> alive_;  // and what each claims to be
  std::unordered_map<dds::Guid, Session, dds::GuidHash> sessions_;
  std::unique_ptr<AckWriters> ack_writers_;
  std::uint64_t dropped_ = 0;
};

}  // namespace plchost
