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
  auto participants =
      dds::check_entity(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
                        "watch participants");
  auto subscriptions = dds::check_entity(
      dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr), "watch readers");
  for (auto* made : {&reply, &ack, &participants, &subscriptions}) {
    if (!*made) return std::unexpected(made->error());
  }
  table.reply_topic_ = std::move(*reply);
  table.ack_topic_ = std::move(*ack);
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
  for (bool more = true; more;) {
    const dds::Samples<dds_builtintopic_participant_t> participants(participants_.get());
    for (std::size_t i = 0; i < participants.size(); ++i) {
      const dds::Guid client = dds::Guid::from(participants[i].key.v);
      if (participants.info(i).instance_state == DDS_IST_ALIVE) {
        alive_.insert(client);
      } else {
        alive_.erase(client);
        sessions_.erase(client);
      }
    }
    more = participants.full();
  }
}

void SessionTable::follow_readers() {
  for (bool more = true; more;) {
    const dds::Samples<dds_builtintopic_endpoint_t> readers(subscriptions_.get());
    for (std::size_t i = 0; i < readers.size(); ++i) {
      if (!readers.valid(i) || readers.info(i).instance_state != DDS_IST_ALIVE) continue;
      const std::string_view topic = readers[i].topic_name;
      if (topic != dds::kReply.name && topic != dds::kEventAck.name) continue;
      // Its writers exist before its first request: they have met their reader when the answer comes.
      (void)session_of(dds::Guid::from(readers[i].participant_key.v));
    }
    more = readers.full();
  }
}

Result<SessionTable::Session> SessionTable::make_session(const dds::Guid& client) const {
  Session session;
  auto publisher = dds::make_publisher(participant_, dds::client_partition(client.hex()));
  if (!publisher) return std::unexpected(publisher.error());
  session.publisher = std::move(*publisher);
  auto reply = dds::make_writer(session.publisher.get(), reply_topic_.get(), dds::reply_qos());
  if (!reply) return std::unexpected(reply.error());
  session.reply_writer = std::move(*reply);
  auto ack = dds::make_writer(session.publisher.get(), ack_topic_.get(), dds::ack_qos());
  if (!ack) return std::unexpected(ack.error());
  session.ack_writer = std::move(*ack);
  return session;
}

SessionTable::Session* SessionTable::session_of(const dds::Guid& client) {
  if (const auto known = sessions_.find(client); known != sessions_.end()) return &known->second;
  if (!alive_.contains(client)) return nullptr;
  if (sessions_.size() >= kMaxSessions) {
    if (dropped_++ % 1000 == 0) spdlog::warn("{} clients are served, one more is not", kMaxSessions);
    return nullptr;
  }
  auto made = make_session(client);
  if (!made) {
    spdlog::error("client {}: {}", client.hex(), made.error().describe());
    return nullptr;
  }
  return &sessions_.emplace(client, std::move(*made)).first->second;
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
  (void)dds_write(session->reply_writer.get(), &reply);  // not read: the client asks again and gets it then
}

void SessionTable::write_ack(const dds::Guid& client, const plc_EventAck& ack) {
  Session* const session = session_of(client);
  if (session != nullptr) (void)dds_write(session->ack_writer.get(), &ack);
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
