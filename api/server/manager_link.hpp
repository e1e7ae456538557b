#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <control.h>

#include "api/dds/guid.hpp"
#include "api/server/status/findings_collector.hpp"
#include "shm/base/time.hpp"
#include "shm/sockets/control_message.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// The waiter for the answer to a command.
struct PendingCommand {
  dds::Guid client;  ///< participant
  plc_SampleIdentity identity{};
  std::string instance;
  TimePoint deadline;
  ControlVerb verb = ControlVerb::status;
  FindingsCollector findings;  ///< of check_host
};

/// A command that has its answer.
struct FinishedCommand {
  PendingCommand command;
  ErrorCode code = ErrorCode::ok;
  std::string text;
};

/// The control socket of the manager, and the commands that it works on. Never waits. Control loop only.
class ManagerLink {
 public:
  /// How many commands may be under way, together and of one client: one client cannot take all places.
  static constexpr std::size_t kMaxPending = 64;
  static constexpr std::size_t kMaxPendingOfClient = 8;
  /// The manager's time for one command. It ends a process (at most 40 s, of which 35 s are the two phases of
  /// a stop) and sets up the next one (at most 30 s).
  static constexpr Duration kCommandLimit = std::chrono::seconds(75);

  /// The manager listens on "RUN_DIRECTORY/manager.sock".
  [[nodiscard]] static Result<ManagerLink> connect(const std::string& run_directory);

  [[nodiscard]] int fd() const noexcept { return socket_.fd(); }
  /// busy: too many commands are under way, or the manager does not read.
  [[nodiscard]] Result<void> send(ControlRequest request, PendingCommand command);
  [[nodiscard]] bool is_pending(const plc_SampleIdentity& identity) const;
  /// The answers since the last time. unavailable: the manager is gone.
  [[nodiscard]] Result<std::vector<FinishedCommand>> receive();
  /// The commands that have not been answered in time.
  [[nodiscard]] std::vector<FinishedCommand> expire(TimePoint now);

 private:
  explicit ManagerLink(PacketSocket socket) noexcept : socket_(std::move(socket)) {}

  PacketSocket socket_;
  std::uint64_t next_number_ = 1;
  std::map<std::uint64_t, PendingCommand> pending_;
};

}  // namespace plchost
