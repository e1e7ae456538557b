#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

/// The version of the messages on control sockets. A peer with another one is refused by name and number.
/// 1: first. 2: requests have a time limit.
inline constexpr int kControlVersion = 2;

/// Option of what loads an application, and its value: the instance starts with it from now on.
inline constexpr std::string_view kBootOption = "boot";
inline constexpr std::string_view kYes = "yes";

/// A request over a control socket: from a client by plchost-dds to the manager, or from that to an instance.
struct ControlRequest {
  std::uint64_t number = 0;  ///< chosen by the sender, comes back in the reply
  ControlVerb verb = ControlVerb::status;
  std::string instance;
  std::string argument;
  std::map<std::string, std::string> options = {};  ///< further arguments, by name
  /// Until when it may be begun: boot_time_ns(), 0: at any time. Each process that takes it from a socket
  /// looks at this first, so that requests that waited there while that process was stopped are not done.
  std::int64_t limit_ns = 0;
  /// Of a client's request and of all its repetitions, which it is done for once; empty: it is not repeated.
  std::string id = {};
};

/// timed_out: that limit of a request is over, so it must not be begun.
[[nodiscard]] Result<void> check_in_time(std::int64_t limit_ns, std::int64_t now_ns = boot_time_ns());

/// The answer to the request of that number.
struct ControlReply {
  std::uint64_t number = 0;
  ErrorCode code = ErrorCode::ok;
  std::string text;  ///< why it was refused; or a soft remark
};

/// One message is one JSON object in one packet.
[[nodiscard]] std::string encode(const ControlRequest& request);
[[nodiscard]] std::string encode(const ControlReply& reply);
/// corrupt: not such a message, or of another version; the text says what was wrong.
[[nodiscard]] Result<ControlRequest> decode_request(std::string_view packet);
[[nodiscard]] Result<ControlReply> decode_reply(std::string_view packet);

}  // namespace plchost
