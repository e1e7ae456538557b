#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "api/dds/entity.hpp"
#include "shm/base/result.hpp"

namespace plchost::dds {

/// The greatest number of servers in one domain on one machine. Each takes the first free one of these port
/// pairs; clients have no fixed port and look at all of them, so that any number of clients can come.
inline constexpr int kMaxServersPerMachine = 16;

enum class Role : std::uint8_t { server, client };

struct DomainOptions {
  std::uint32_t domain = 0;
  std::vector<std::string> interfaces{"lo"};  ///< network interfaces
  /// Where servers are looked for. Empty, and on "lo": 127.0.0.1.
  std::vector<std::string> peers;
  /// Look for others by multicast, too, on all interfaces but "lo"; samples never go by multicast.
  bool multicast = true;
  /// SCHED_FIFO priority of the threads that receive, 0: SCHED_OTHER. Only if can_use_fifo() said yes:
  /// Cyclone aborts the process when it may not.
  int receive_fifo = 0;
  /// The folder of the identity that this process shows (see api/security/identity.hpp). Empty: unsecured.
  std::string identity = {};

  bool operator==(const DomainOptions&) const = default;
};

/// The configuration as Cyclone wants it. Does not look into the folder of the identity. Every value in it
/// that is not a default was measured.
[[nodiscard]] Result<std::string> domain_configuration(Role role, const DomainOptions& options);

/// Whether this process may make a SCHED_FIFO thread of that priority: tried, not guessed.
[[nodiscard]] bool can_use_fifo(int priority);

/// A domain of this process, and with it its configuration. One process can have a domain once: a second
/// request gets the same one, as it is configured. An identity that others would not accept is an error that
/// says why. Thread-safe.
[[nodiscard]] Result<std::shared_ptr<Entity>> open_domain(Role role, const DomainOptions& options);

/// A participant in a domain of this process. `qos` may be null. Thread-safe, which Cyclone 0.10.2 is not: of
/// a secured domain, the first two that are made at the same time both load the security plugins. The plugins
/// of one of them do not know the identity that was given to those of the other.
[[nodiscard]] Result<Entity> make_participant(std::uint32_t domain, const dds_qos_t* qos,
                                              std::string_view what);

/// Ties all UDP sockets of this process to the loopback device. Cyclone binds its receive sockets to any
/// address even when it is told to use "lo" only, and parses what arrives; with this the kernel drops it.
/// After the participant is made. Returns how many sockets were tied.
[[nodiscard]] Result<int> tie_sockets_to_loopback();

}  // namespace plchost::dds
