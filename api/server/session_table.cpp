#include "api/server/session_table.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "api/dds/error.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/topics.hpp"
#include "api/server/manager_link.hpp"
#include "shm/base/log.hpp"

namespace plchost {

Result<SessionTable> SessionTable::create(dds_entity_t participant) {
  SessionTable table;
  table.participant_ = participant;
  auto reply = dds::make_topic(participant, dds::kReply);
  auto ack = dds::make_topic(participant, dds::kEventAck);
  auto page = dds::make_topic(participant, dds::kObjectPage);
  auto participants =
      dds::check_entity(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
                        "watch participants");
  auto subscriptions = dds::check_entity(
      dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr), "watch readers");
  for (auto* made : {&reply, &ack, &page, &participants, &subscriptions}) {
    if (!*made) return std::unexpected(made->error());
  }
  table.reply_topic_ = std::move(*reply);
  table.ack_topic_ = std::move(*ack);
  table.page_topic_ = std::move(*page);
  table.participants_ = std::move(*participants);
  table.subscriptions_ = std::move(*subscriptions);
  return table;
}

std::vector<dds_entity_t> SessionTable::discovery_readers() const {
  return {participants_.get(), subscriptions_.get()};
}

void SessionTable::follow_discovery() {
  follow_participants();
  follow_readers();
}

void SessionTable::follow_participants() {
  using Participant = dds_builtintopic_participant_t;
  dds::take_all<Participant>(participants_.get(), [this](const Participant& participant, const auto& info) {
    const dds::Guid client = dds::Guid::from(participant.key.v);
    if (info.instance_state == DDS_IST_ALIVE) {
      alive_.insert(client);
    } else {
      alive_.erase(client);
      sessions_.erase(client);
    }
  });
}

void SessionTable::follow_readers() {
  using Reader = dds_builtintopic_endpoint_t;
  dds::take_valid<Reader>(subscriptions_.get(), [this](const Reader& reader, const auto& info) {
    if (info.instance_state != DDS_IST_ALIVE) return;
    const std::string_view topic = reader.topic_name;
    const bool replies = topic == dds::kReply.name;
    const bool pages = topic == dds::kObjectPage.name;
    if (!replies && !pages && topic != dds::kEventAck.name) return;
    Session* const session = session_of(dds::Guid::from(reader.participant_key.v));
    if (session == nullptr) return;
    // The writer exists before the first request: it has met its reader when the answer comes. One that
    // nobody reads is not made: each is announced to every client.
    if (replies) {
      (void)open_writer(*session, session->reply_writer, reply_topic_, dds::reply_qos());
    } else if (pages) {
      (void)open_writer(*session, session->page_writer, page_topic_, dds::object_page_qos());
    } else {
      (void)open_writer(*session, session->ack_writer, ack_topic_, dds::ack_qos());
    }
  });
}

bool SessionTable::open_writer(const Session& session, dds::Entity& writer, const dds::Entity& topic,
                               const dds::Qos& qos) {
  if (writer) return true;
  auto made = dds::make_writer(session.publisher.get(), topic.get(), qos);
  if (made) {
    writer = std::move(*made);
  } else {
    spdlog::error("{}", made.error().describe());
  }
  return made.has_value();
}

SessionTable::Session* SessionTable::session_of(const dds::Guid& client) {
  if (const auto known = sessions_.find(client); known != sessions_.end()) return &known->second;
  if (!alive_.contains(client)) return nullptr;
  if (sessions_.size() >= kMaxSessions) {
    if (dropped_++ % 1000 == 0) spdlog::warn("{} clients are served, one more is not", kMaxSessions);
    return nullptr;
  }
  auto publisher = dds::make_publisher(participant_, dds::client_partition(client.hex()));
  if (!publisher) {
    spdlog::error("client {}: {}", client.hex(), publisher.error().describe());
    return nullptr;
  }
  return &sessions_.emplace(client, Session{std::move(*publisher), {}, {}, {}, {}}).first->second;
}

void SessionTable::write_reply(const dds::Guid& client, const plc_Reply& reply) {
  Session* const session = session_of(client);
  if (session == nullptr) return;
  const auto known = std::ranges::find_if(session->answers, [&](const plc_Reply& answer) {
    return same_identity(answer.header.related_identity, reply.header.related_identity);
  });
  if (known == session->answers.end()) {
    session->answers.push_back(reply);
    if (session->answers.size() > kRemembered) session->answers.pop_front();
  }
  if (!open_writer(*session, session->reply_writer, reply_topic_, dds::reply_qos())) return;
  (void)dds_write(session->reply_writer.get(), &reply);  // not read: the client asks again and gets it then
}

void SessionTable::write_ack(const dds::Guid& client, const plc_EventAck& ack) {
  Session* const session = session_of(client);
  if (session == nullptr) return;
  if (!open_writer(*session, session->ack_writer, ack_topic_, dds::ack_qos())) return;
  (void)dds_write(session->ack_writer.get(), &ack);
}

bool SessionTable::write_page(const dds::Guid& client, const plc_ObjectPage& page) {
  Session* const session = session_of(client);
  if (session == nullptr) return false;
  if (!open_writer(*session, session->page_writer, page_topic_, dds::object_page_qos())) return false;
  return dds_write(session->page_writer.get(), &page) == DDS_RETCODE_OK;
}

std::optional<plc_Reply> SessionTable::remembered(const dds::Guid& client,
                                                  const plc_SampleIdentity& identity) const {
  const auto session = sessions_.find(client);
  if (session == sessions_.end()) return std::nullopt;
  for (const plc_Reply& answer : session->second.answers) {
    if (same_identity(answer.header.related_identity, identity)) return answer;
  }
  return std::nullopt;
}

}  // namespace plchost
