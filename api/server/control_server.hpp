#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <control.h>

#include "api/dds/domain.hpp"
#include "api/server/access/variable_rights.hpp"
#include "shm/base/result.hpp"
#include "shm/block_driver/node_directory.hpp"

namespace plchost {

/// The options on the command line of plchost-dds.
struct ServerOptions {
  std::string host;
  std::string pool;
  std::string run_directory;
  dds::DomainOptions dds;
  bool allow_unsecured = false;  ///< without an identity: may be on other interfaces than "lo"
  /// How many datagrams were refused so far, for the log; null: nobody counts.
  std::uint64_t (*refused_datagrams)() noexcept = nullptr;
  /// The words of its participant for other hosts (dds::words_of()); empty: none. With them it is not there
  /// for hosts that it does not concern, so it has to do the same (close_receive_gate()).
  std::string announced;
  std::string blocks_base =
      std::string(kDefaultBlockBase);  ///< of the nodes that are listed, and the gateway
  std::vector<std::string> labels;     ///< by which clients choose hosts
  VariableRights variable_rights;
  std::string audit_folder;                  ///< of the log of what clients change; empty: there is none
  std::string applications_folder;           ///< of the applications that were sent; empty: there is none
  std::uint32_t application_limit_mib = 64;  ///< of a file that is sent
  std::uint16_t host_number = 0;             ///< for other hosts; 0: no gateway
  std::int64_t name_since_ns = 0;            ///< from when on this host has its name; 0: from now on
  bool own_user = false;                     ///< another one than the manager's, which has the same group
  int beat_fd = -1;                          ///< an eventfd that the loop counts up while it runs; -1: none
  bool name_held = false;                    ///< a server before this one had the name: nobody is asked
  bool name_refused = false;  ///< a server before this one was refused the name: ask for longer
};

/// The server's end of the DDS API. Posts are done in DDS's receiving thread (on_event_post); everything else
/// in one loop: requests, the manager's answers, acknowledgements, status, presence.
class ControlServer {
 public:
  /// Attaches the pool, reaches the manager and enters the domain. already_exists: another host of the domain
  /// has the name.
  [[nodiscard]] static Result<std::unique_ptr<ControlServer>> create(ServerOptions options);
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  ~ControlServer();

  /// Serves until SIGTERM or SIGINT, or until the manager is gone. It also ends when the files of the host's
  /// identity have changed, or another host that had this name as well is gone: both take a fresh process.
  /// All of these are orderly ends. already_exists: another host of the domain has the name.
  [[nodiscard]] Result<void> run();

 private:
  struct Parts;
  explicit ControlServer(std::unique_ptr<Parts> parts) noexcept;
  std::unique_ptr<Parts> parts_;
};

}  // namespace plchost
