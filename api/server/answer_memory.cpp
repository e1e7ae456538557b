#include "api/server/answer_memory.hpp"

#include <algorithm>
#include <utility>

#include "api/dds/sample_identity.hpp"

namespace plchost {

void AnswerMemory::remember(const dds::Guid& client, Answer answer, TimePoint now) {
  if (find(client, answer.identity) != nullptr) return;
  make_room(client, now);
  Answers& answers = clients_[client];
  answers.last = now;
  if (answers.of_requests.size() >= kOfClient) {
    answers.of_requests.erase(answers.of_requests.begin());
    --count_;
  }
  answers.of_requests.push_back(std::move(answer));
  ++count_;
}

void AnswerMemory::make_room(const dds::Guid& client, TimePoint now) {
  const auto is_full = [&] {
    return count_ >= kMost || (clients_.size() >= kMaxClients && !clients_.contains(client));
  };
  if (!is_full()) return;
  std::erase_if(clients_, [&](const auto& known) {
    const bool is_old = now - known.second.last >= kKept;
    if (is_old) count_ -= known.second.of_requests.size();
    return is_old;
  });
  while (is_full()) {
    const auto oldest =
        std::ranges::min_element(clients_, {}, [](const auto& known) { return known.second.last; });
    count_ -= oldest->second.of_requests.size();
    clients_.erase(oldest);
  }
}

const Answer* AnswerMemory::find(const dds::Guid& client, const plc_SampleIdentity& identity) const {
  const auto known = clients_.find(client);
  if (known == clients_.end()) return nullptr;
  const auto& answers = known->second.of_requests;
  const auto answer =
      std::ranges::find_if(answers, [&](const Answer& one) { return same_identity(one.identity, identity); });
  return answer == answers.end() ? nullptr : &*answer;
}

}  // namespace plchost
