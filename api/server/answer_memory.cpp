#include "api/server/answer_memory.hpp"

#include <algorithm>

#include "api/dds/sample_identity.hpp"

namespace plchost {

void AnswerMemory::remember(const dds::Guid& client, const plc_Reply& reply, TimePoint now) {
  if (find(client, reply.header.related_identity) != nullptr) return;
  if (clients_.size() >= kMaxClients && !clients_.contains(client)) make_room(now);
  Answers& answers = clients_[client];
  answers.last = now;
  answers.replies.push_back(reply);
  if (answers.replies.size() > kOfClient) answers.replies.pop_front();
}

void AnswerMemory::make_room(TimePoint now) {
  std::erase_if(clients_, [&](const auto& client) { return now - client.second.last >= kKept; });
  if (clients_.size() < kMaxClients) return;
  clients_.erase(
      std::ranges::min_element(clients_, {}, [](const auto& client) { return client.second.last; }));
}

const plc_Reply* AnswerMemory::find(const dds::Guid& client, const plc_SampleIdentity& identity) const {
  const auto known = clients_.find(client);
  if (known == clients_.end()) return nullptr;
  const auto answer = std::ranges::find_if(known->second.replies, [&](const plc_Reply& reply) {
    return same_identity(reply.header.related_identity, identity);
  });
  return answer == known->second.replies.end() ? nullptr : &*answer;
}

}  // namespace plchost
