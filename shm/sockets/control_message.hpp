#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The version of the messages on control sockets. A peer with another one is refused by name and number.
/// 1: first. 2: requests have a time limit.
inline constexpr int kControlVersion = 2;

/// The requests about an instance, by the API server to the manager and by the manager to the instance.
enum class ControlVerb : std::uint8_t {
  start,                 ///< run the application
  stop,                  ///< stop the application; the process stays
  reset,                 ///< warm reset: fresh process, application loaded anew and stopped
  reset_cold,            ///< the same, and the application is told so: it starts with initial values
  single_cycle,          ///< one cycle of each cyclic and freewheeling task, from stopped
  restart,               ///< fresh process, application running
  reset_statistics,      ///< argument: name of a task; empty: all tasks
  load_application,      ///< argument: path of the application on the host; options: see kBootOption
  download_application,  ///< argument: name of what was sent; options: see api/control/application_order.hpp
  rollback_application,  ///< load what was loaded before; options: see kBootOption
  change_application,    ///< (manager to instance only) argument: a path; it takes over while tasks run
  set_scheduler,         ///< argument: name of a scheduler
  register_event,        ///< argument: name of an external event
  unregister_event,      ///< argument: name of an external event
  check_host,            ///< of the manager, no instance: look at the host; see api/control/host_finding.hpp
  reload_host,           ///< of the manager, no instance: take over the configuration file as it is now
  list_objects,          ///< answered by the API server itself, from the pool
  list_nodes,            ///< the same, from the directory of the nodes that send blocks
  list_routes,           ///< the same
  read_clock,            ///< answered by the API server itself
  read_log,              ///< the same, from the log of the instance
  shutdown,              ///< (manager to instance only) stop the application and end the process
  status,                ///< (manager to instance only) the reply's text is the InstanceReport
  set_log_level,         ///< (manager to instance only) argument: one of kLogLevels
};

[[nodiscard]] std::string_view to_string(ControlVerb verb) noexcept;

/// Option of what loads an application, and its value: the instance starts with it from now on.
inline constexpr std::string_view kBootOption = "boot";
inline constexpr std::string_view kYes = "yes";

struct ControlRequest {
  std::uint64_t number = 0;  ///< chosen by the sender, comes back in the reply
  ControlVerb verb = ControlVerb::status;
  std::string instance;
  std::string argument;
  std::map<std::string, std::string> options = {};  ///< further arguments, by name
  /// Until when it may be begun: boot_time_ns(), 0: at any time. Each process that takes it from a socket
  /// looks at this first, so that what waited there while that process was stopped is not done.
  std::int64_t limit_ns = 0;
};

/// timed_out: that limit of a request is over, so it must not be begun.
[[nodiscard]] Result<void> check_in_time(std::int64_t limit_ns, std::int64_t now_ns = boot_time_ns());

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
