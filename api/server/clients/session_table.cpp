#include "api/server/clients/session_table.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "api/dds/claim.hpp"
#include "api/dds/error.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/secured_announcement.h"
#include "api/dds/topics.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// By SessionTable::Stream.
constexpr std::array kStreamTopics{dds::kReply,     dds::kEventAck, dds::kObjectPage,  dds::kNodePage,
                                   dds::kLogPage,   dds::kEventRun, dds::kDownloadAck, dds::kVariablePage,
                                   dds::kDebugPage, dds::kTracePage};

}  // namespace

Result<SessionTable> SessionTable::create(dds_entity_t participant, std::string host) {
  static_assert(kStreamTopics.size() == kStreams);
  SessionTable table;
  PLCHOST_TRY_ASSIGN(table.reaper_, dds::EntityReaper::create());
  table.participant_ = participant;
  table.ack_writers_ = std::make_unique<AckWriters>(host);
  table.host_ = std::move(host);
  for (std::size_t i = 0; i < kStreams; ++i) {
    PLCHOST_TRY_ASSIGN(table.topics_[i], dds::make_topic(participant, kStreamTopics[i]));
  }
  PLCHOST_TRY_ASSIGN(
      table.participants_,
      dds::check_entity(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
                        "cannot watch participants"));
  PLCHOST_TRY_ASSIGN(
      table.subscriptions_,
      dds::check_entity(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr),
                        "cannot watch readers"));
  return table;
}

std::vector<dds_entity_t> SessionTable::discovery_readers() const {
  return {participants_.get(), subscriptions_.get()};
}

std::vector<dds::Guid> SessionTable::participants() const {
  std::vector<dds::Guid> all;
  all.reserve(alive_.size());
  for (const auto& [guid, claim] : alive_) all.push_back(guid);
  return all;
}

std::uint64_t SessionTable::follow_discovery() {
  const std::uint64_t changes = follow_participants();
  follow_readers();
  return changes;
}

std::uint64_t SessionTable::follow_participants() {
  using Participant = dds_builtintopic_participant_t;
  std::uint64_t changes = 0;
  dds::take_all<Participant>(participants_.get(), [&](const Participant& participant, const auto& info) {
    const dds::Guid client = dds::Guid::from(participant.key.v);
    if (info.instance_state == DDS_IST_ALIVE) {
      alive_[client] = info.valid_data ? dds::claim_of(participant.qos) : std::string();
      (void)plc_spare_announcement(participant_, &participant.key);
    } else {
      alive_.erase(client);
      end_session(client);
    }
    ++changes;
  });
  return changes;
}

void SessionTable::follow_readers() {
  using Reader = dds_builtintopic_endpoint_t;
  dds::take_valid<Reader>(subscriptions_.get(), [this](const Reader& reader, const auto& info) {
    if (info.instance_state != DDS_IST_ALIVE) return;
    const auto* const topic =
        std::ranges::find(kStreamTopics, std::string_view(reader.topic_name), &dds::TopicInfo::name);
    if (topic == kStreamTopics.end()) return;
    const dds::Guid client = dds::Guid::from(reader.participant_key.v);
    Session* const session = session_of(client);
    // The writer exists before the first request: it has met its reader when the answer comes. One that
    // nobody reads is not made: each is announced to every client.
    if (session != nullptr) {
      (void)open_writer(client, *session, static_cast<Stream>(topic - kStreamTopics.begin()));
    }
  });
}

bool SessionTable::open_writer(const dds::Guid& client, Session& session, Stream stream) {
  dds::Entity& writer = session.writers[std::to_underlying(stream)];
  if (writer) return true;
  const auto index = std::to_underlying(stream);
  auto made =
      dds::make_writer(session.publisher.get(), topics_[index].get(), dds::qos_of(kStreamTopics[index]));
  if (made) {
    writer = std::move(*made);
    if (stream == Stream::acks) ack_writers_->add(client, writer.get());
  } else {
    spdlog::error("{}", made.error().describe());
  }
  return made.has_value();
}

SessionTable::Session* SessionTable::session_of(const dds::Guid& client) {
  const TimePoint now = MonotonicClock::now();
  if (const auto known = sessions_.find(client); known != sessions_.end()) {
    known->second.used = now;
    return &known->second;
  }
  if (!alive_.contains(client)) return nullptr;
  if (sessions_.size() >= kMaxSessions && !make_room(now)) {
    if (dropped_++ % 1000 == 0) spdlog::warn("session limit {} reached; client rejected", kMaxSessions);
    return nullptr;
  }
  auto publisher = dds::make_publisher(participant_, dds::client_partition(client.hex(), host_));
  if (!publisher) {
    spdlog::error("client {}: {}", client.hex(), publisher.error().describe());
    return nullptr;
  }
  return &sessions_.emplace(client, Session{.publisher = std::move(*publisher), .used = now}).first->second;
}

bool SessionTable::make_room(TimePoint now) {
  const auto longest =
      std::ranges::min_element(sessions_, {}, [](const auto& known) { return known.second.used; });
  if (longest == sessions_.end() || now - longest->second.used < kIdle) return false;
  end_session(dds::Guid(longest->first));
  return true;
}

void SessionTable::end_session(const dds::Guid& client) {
  ack_writers_->remove(client);
  auto ended = sessions_.extract(client);
  if (ended.empty()) return;
  std::vector<dds::Entity> entities;
  for (dds::Entity& writer : ended.mapped().writers) entities.push_back(std::move(writer));
  entities.push_back(std::move(ended.mapped().publisher));
  reaper_->take(std::move(entities));
}

std::string SessionTable::describe(const dds::Guid& client) const {
  const auto known = alive_.find(client);
  if (known == alive_.end() || known->second.empty()) return "client " + client.hex();
  return known->second + ", client " + client.hex();
}

void SessionTable::write_reply(const dds::Guid& client, const plc_Reply& reply) {
  (void)write(client, Stream::replies, &reply);  // not read: the client asks again and gets it then
}

void SessionTable::write_ack(const dds::Guid& client, const plc_EventAck& ack) {
  Session* const session = session_of(client);
  if (session == nullptr || !open_writer(client, *session, Stream::acks)) return;
  (void)ack_writers_->write(client, ack);
}

void SessionTable::write_ack(const dds::Guid& client, const plc_DownloadAck& ack) {
  (void)write(client, Stream::downloads, &ack);
}

void SessionTable::was_answered(const dds::Guid& client, TimePoint now) {
  if (const auto known = sessions_.find(client); known != sessions_.end()) known->second.used = now;
}

void SessionTable::write_run(const dds::Guid& client, const plc_EventRun& run) {
  (void)write(client, Stream::runs, &run);
}

bool SessionTable::write_page(const dds::Guid& client, const plc_ObjectPage& page) {
  return write(client, Stream::objects, &page);
}

bool SessionTable::write_page(const dds::Guid& client, const plc_NodePage& page) {
  return write(client, Stream::nodes, &page);
}

bool SessionTable::write_page(const dds::Guid& client, const plc_LogPage& page) {
  return write(client, Stream::logs, &page);
}

bool SessionTable::write_page(const dds::Guid& client, const plc_VariablePage& page) {
  return write(client, Stream::variables, &page);
}

bool SessionTable::write_page(const dds::Guid& client, const plc_DebugPage& page) {
  return write(client, Stream::debug, &page);
}

bool SessionTable::write_page(const dds::Guid& client, const plc_TracePage& page) {
  return write(client, Stream::traces, &page);
}

bool SessionTable::write(const dds::Guid& client, Stream stream, const void* sample) {
  Session* const session = session_of(client);
  if (session == nullptr || !open_writer(client, *session, stream)) return false;
  return dds_write(session->writers[std::to_underlying(stream)].get(), sample) == DDS_RETCODE_OK;
}

}  // namespace plchost
