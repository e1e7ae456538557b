#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include <control.h>

#include "api/dds/guid.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The answer to a request.
struct Answer {
  plc_SampleIdentity identity{};
  ErrorCode code = ErrorCode::ok;
  std::uint64_t status_round = 0;
  std::string text = {};
};

/// The answers that clients got, so that a repeated request is answered and not done twice. That holds also
/// for a client that was out of reach meanwhile, and that nobody can send anything to at this moment. A
/// request that only reads is not remembered: it is done again. Bounded by clients, by answers of each and of
/// all together. Control loop only.
class AnswerMemory {
 public:
  /// As many are remembered for each client.
  static constexpr std::size_t kOfClient = 32;
  /// Of more clients those are forgotten whose last answer is the oldest.
  static constexpr std::size_t kMaxClients = 1024;
  /// Of all clients together: some 100 bytes each, and at most 511 bytes of text.
  static constexpr std::size_t kMost = 2048;
  /// After its last answer a client is forgotten: longer than any client repeats a request.
  static constexpr Duration kKept = std::chrono::minutes(5);

  /// `client` is a participant. An answer that is there already is kept as it is.
  void remember(const dds::Guid& client, Answer answer, TimePoint now);
  /// Valid until the next call of remember().
  [[nodiscard]] const Answer* find(const dds::Guid& client, const plc_SampleIdentity& identity) const;

  [[nodiscard]] std::size_t clients() const noexcept { return clients_.size(); }
  [[nodiscard]] std::size_t answers() const noexcept { return count_; }

 private:
  struct Answers {
    std::vector<Answer> of_requests;  ///< oldest first
    TimePoint last;
  };
  void make_room(const dds::Guid& client, TimePoint now);

  std::unordered_map<dds::Guid, Answers, dds::GuidHash> clients_;
  std::size_t count_ = 0;  // of answers
};

}  // namespace plchost
