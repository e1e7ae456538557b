#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "shm/base/time.hpp"
#include "shm/sockets/control_message.hpp"

namespace plchost {

/// Requests that may be repeated over another connection, as a client does when its server has ended: each is
/// done once, and all that have asked get its answer. Those without an id are not known again.
class KnownRequests {
 public:
  /// So many; when all of them are under way, a further one is not known again.
  static constexpr std::size_t kMost = 512;
  /// How long an answer is kept: longer than a client repeats its request.
  static constexpr Duration kKept = std::chrono::minutes(2);

  /// A request of a connection.
  struct Asker {
    std::uint64_t connection = 0;
    std::uint64_t number = 0;
  };
  /// The answer of a request that has come before; none: it is under way.
  struct Earlier {
    std::optional<ControlReply> answer;
  };

  /// Nothing: it is new. If it is under way, end() names this asker, too.
  [[nodiscard]] std::optional<Earlier> find(const ControlRequest& request, Asker asker);
  /// A new one is under way.
  void begin(const ControlRequest& request, Asker asker, TimePoint now);
  /// It is done: all that have asked, `asker` among them.
  [[nodiscard]] std::vector<Asker> end(const std::string& id, Asker asker, const ControlReply& reply,
                                       TimePoint now);

 private:
  struct Known {
    ControlRequest request;
    std::vector<Asker> askers;
    std::optional<ControlReply> answer = {};
    TimePoint answered_at = {};
  };
  void make_room(TimePoint now);

  std::map<std::string, Known> known_;
};

}  // namespace plchost
