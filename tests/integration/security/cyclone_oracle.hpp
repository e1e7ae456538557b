#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "shm/base/unique_fd.hpp"
#include "tests/integration/security/gate_board.hpp"
#include "tests/integration/security/packets.hpp"

namespace plchost {

/// Cyclone itself behind the gate, in a process of its own: says whether it survives a datagram.
class CycloneOracle {
 public:
  /// `program`: gated_cyclone. Nothing: it does not start.
  [[nodiscard]] static std::optional<CycloneOracle> start(const std::string& program, std::uint32_t domain);
  CycloneOracle(CycloneOracle&& other) noexcept;
  CycloneOracle& operator=(CycloneOracle&&) = delete;
  CycloneOracle(const CycloneOracle&) = delete;
  CycloneOracle& operator=(const CycloneOracle&) = delete;
  ~CycloneOracle();

  /// The packets that a client has sent to it before.
  [[nodiscard]] std::vector<Packet> seeds() const;
  /// Waits until Cyclone has few datagrams before it. False: it has ended, or has hung for 10 s.
  [[nodiscard]] bool feed(const Packet& packet);
  /// Waits until it has read all.
  [[nodiscard]] bool flush();
  /// How many datagrams the gate has let pass.
  [[nodiscard]] std::uint64_t passed() const { return board_->passed; }
  /// The newest ones that it was fed, in order, each with its size in front: to find the one that ended it.
  void save_last(const std::string& path) const;

 private:
  CycloneOracle(pid_t pid, GateBoard* board, UniqueFd socket, std::uint16_t port)
      : pid_(pid), board_(board), socket_(std::move(socket)), port_(port) {}
  [[nodiscard]] bool wait_until_done(std::uint64_t count);

  static constexpr std::uint64_t kUnderWay = 64;
  static constexpr std::size_t kLast = 1024;

  pid_t pid_;
  GateBoard* board_;
  UniqueFd socket_;
  std::uint16_t port_;
  std::uint64_t sent_ = 0;
  std::deque<Packet> last_;
};

}  // namespace plchost
