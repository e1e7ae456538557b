#pragma once

#include <cstddef>
#include <deque>
#include <unordered_map>

#include <control.h>

#include "api/dds/guid.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The answers that clients got, so that a repeated request is answered and not done twice: also for a client
/// that was out of reach meanwhile, and that nobody can send anything to at this moment. Control loop only.
class AnswerMemory {
 public:
  /// As many are remembered for each client.
  static constexpr std::size_t kOfClient = 32;
  /// Of more clients those are forgotten whose last answer is the oldest.
  static constexpr std::size_t kMaxClients = 1024;
  /// After its last answer a client is forgotten: longer than any client repeats a request.
  static constexpr Duration kKept = std::chrono::minutes(5);

  /// `client` is a participant. An answer that is there already is kept as it is.
  void remember(const dds::Guid& client, const plc_Reply& reply, TimePoint now);
  /// Valid until the next call of remember().
  [[nodiscard]] const plc_Reply* find(const dds::Guid& client, const plc_SampleIdentity& identity) const;

  [[nodiscard]] std::size_t clients() const noexcept { return clients_.size(); }

 private:
  struct Answers {
    std::deque<plc_Reply> replies;
    TimePoint last;
  };
  void make_room(TimePoint now);

  std::unordered_map<dds::Guid, Answers, dds::GuidHash> clients_;
};

}  // namespace plchost
