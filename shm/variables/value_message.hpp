#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/sockets/packet_socket.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

// The packets of RUN_DIRECTORY/INSTANCE.vals, on which the API server asks an instance for values. Binary, of
// one machine: a request names up to kMaxRequestedValues elements of one table. The instance copies all of
// them in one moment in which no task is within a cycle. It answers in one or several packets of up to
// kMaxPacket bytes, in order. A connection has one request at a time: the next one is sent when the reply has
// come.

inline constexpr std::size_t kMaxRequestedValues = 1024;
/// Of all values of a request together. More is answered with ErrorCode::full.
inline constexpr std::size_t kMaxValueBytes = 98304;
/// So long an instance looks for such a moment. Then it copies the values all the same, and says so.
inline constexpr auto kSampleLimit = std::chrono::milliseconds(200);

/// Which values are asked for.
enum class ValueKind : std::uint32_t {
  current = 0,  ///< of the named elements
  forced = 1,   ///< of all elements that are forced, whatever is named: the values that they are forced to
};

struct ValueRequest {
  std::uint64_t number = 0;  ///< chosen by the sender, comes back
  std::uint64_t stream = 0;  ///< of the symbol table by which the elements are named
  ValueKind kind = ValueKind::current;
  std::vector<VariableElement> elements = {};
};

/// One sample.
struct ValueReply {
  std::uint64_t number = 0;
  /// wrong_state: the table is another one by now, or none: open it anew. not_found: an element that the
  /// table does not have. full. busy: there are too many connections. corrupt: the packet is no request. With
  /// these there is nothing else in it.
  ErrorCode code = ErrorCode::ok;
  bool consistent = false;        ///< no task was within a cycle
  std::int64_t time_unix_ns = 0;  ///< when it was taken
  std::int64_t time_monotonic_ns = 0;
  std::vector<VariableElement> elements = {};  ///< in the order of the request
  std::vector<std::uint8_t> forced = {};       ///< for each: 1 if it is forced
  std::vector<std::byte> values = {};          ///< one behind the other, each with the bytes of its variable
};

[[nodiscard]] std::string encode(const ValueRequest& request);
/// corrupt: not such a packet, of another version, or with more elements than allowed.
[[nodiscard]] Result<ValueRequest> decode_value_request(std::string_view packet);

/// The packets of a reply, each of at most kMaxPacket bytes. It has at most kMaxRequestedValues elements and
/// kMaxValueBytes of values.
[[nodiscard]] std::vector<std::string> encode(const ValueReply& reply);
/// Puts the packets of replies together. One for each connection.
class ValueReplyReader {
 public:
  /// The reply that this packet completes; nothing: more packets follow. corrupt: not a packet that can
  /// follow: the connection is of no use any more.
  [[nodiscard]] Result<std::optional<ValueReply>> take(std::string_view packet);

 private:
  std::string pending_;
};

/// "RUN_DIRECTORY/INSTANCE.vals": as long as the path of its control socket.
[[nodiscard]] std::string values_socket_path(std::string_view run_directory, std::string_view instance);

}  // namespace plchost
