#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "instances/io/modbus/client/pdu.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"

namespace plchost::modbus {

/// The requests to one device of a serial line that it may still answer. Nothing there says which request a
/// response belongs to, only its shape. A device answers its requests in order, or loses some of them. So a
/// response is that of the first request that it fits, for all that is known here, and those behind that one
/// may still be answered. Only if the first one is the last one there is no doubt. Pure.
class Unanswered {
 public:
  /// So many requests are remembered: the response to an older one is not told apart.
  static constexpr std::size_t kMost = 16;
  /// So many, of which nothing is known, may be left of a process before.
  static constexpr std::size_t kOfProcessBefore = 4;

  [[nodiscard]] static Unanswered of_process_before();

  /// The last request had no response that fits it.
  void given_up(ResponseShape shape);
  /// The last request, with that shape, had a response that fits it.
  void answered(ResponseShape shape);
  /// The last request, with that shape, was refused. All exceptions of a function are alike.
  void refused(ResponseShape shape);

  /// A response of that shape may be one to an earlier request.
  [[nodiscard]] bool may_come(ResponseShape shape) const;
  /// A map to read before a request whose response may be an earlier one's, until it cannot be that any more.
  /// Its response can be taken for no other: it is another map, or less or more of one. If all may still
  /// come, it moves the earlier ones on. Nothing: `reads` has one map, and no other shape.
  [[nodiscard]] std::optional<RegisterMap> probe(const std::vector<RegisterMap>& reads) const;

 private:
  template <class Fits>
  void settle(ResponseShape shape, const Fits& fits);

  std::deque<ResponseShape> requests_;  ///< the oldest one first; without a function: of any shape
};

}  // namespace plchost::modbus
