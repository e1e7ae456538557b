#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost {

/// The datagrams that this process, a client of one secured host, sends and receives. One at a time.
class Wire {
 public:
  /// The newest requests for authentication. Empty: none. A side sends none if the other's came in time.
  struct Requests {
    std::string received;
    std::string sent;
  };

  Wire();
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;
  ~Wire();

  /// The next ones that come are lost.
  void lose_last_messages(int count);
  /// How many last messages of a handshake have come, with those that were lost.
  [[nodiscard]] int last_messages() const;
  /// Returns when one more has come. False: none does.
  [[nodiscard]] bool await_last_message(Duration patience) const;
  /// From now on, the keys that the host tells participants of this process are lost, except those for the
  /// participant with that GUID prefix.
  void lose_keys_but_of(const std::string& but);
  /// How many datagrams this process has sent, to whomever.
  [[nodiscard]] int sent() const;
  /// How many datagrams with keys were lost.
  [[nodiscard]] int lost_keys() const;
  /// For that long, nothing is received.
  static void make_deaf(Duration time);
  /// For that long, all that is sent is lost.
  static void make_mute(Duration time);
  /// The GUID prefix of the host; empty: it has sent no last message of a handshake.
  [[nodiscard]] std::string host() const;
  [[nodiscard]] Requests requests() const;
  /// The GUID prefix of this process; empty: it has sent no message of a handshake.
  [[nodiscard]] std::string client() const;
  /// The host's port of this machine that messages of a handshake were sent to last; 0: none were.
  [[nodiscard]] std::uint16_t host_port() const;
};

/// Of all sockets of this process.
[[nodiscard]] std::vector<std::uint16_t> own_udp_ports();

/// As a stranger on this machine.
void send_to(const std::vector<std::uint16_t>& ports, const std::string& datagram);

}  // namespace plchost
