#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// The largest packet on a control socket, bytes.
inline constexpr std::size_t kMaxPacket = 16384;

/// One end of a connected local SEQPACKET socket: whole messages, in order, and the end of the peer is seen.
/// Soft threads only. Non-blocking unless said otherwise.
class PacketSocket {
 public:
  PacketSocket() noexcept = default;
  explicit PacketSocket(UniqueFd fd) noexcept : fd_(std::move(fd)) {}

  /// Connects to the socket file at `path`. unavailable: nobody listens there; busy: too many connect at
  /// once.
  [[nodiscard]] static Result<PacketSocket> connect(const std::string& path);

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  [[nodiscard]] explicit operator bool() const noexcept { return static_cast<bool>(fd_); }

  /// 1 to kMaxPacket bytes. busy: the peer does not read; unavailable: the peer is gone.
  [[nodiscard]] Result<void> send(std::string_view packet);
  /// Nothing: no packet is there now. unavailable: the peer is gone. corrupt: larger than kMaxPacket.
  [[nodiscard]] Result<std::optional<std::string>> receive();
  /// The process at the other end, as the kernel says.
  [[nodiscard]] Result<int> peer_pid() const;
  /// The user that it had when it connected or began to listen.
  [[nodiscard]] Result<uid_t> peer_user() const;
  /// Whether the other end is closed, as when its process has ended. Takes no packet.
  [[nodiscard]] bool is_cut() const noexcept;
  void close() noexcept { fd_.reset(); }

 private:
  UniqueFd fd_;
};

/// Listens on a socket file, which it makes (mode 0660, an old one of the same name is replaced) and removes.
class PacketListener {
 public:
  [[nodiscard]] static Result<PacketListener> listen(const std::string& path);
  PacketListener(PacketListener&&) noexcept = default;
  PacketListener& operator=(PacketListener&& other) noexcept;
  PacketListener(const PacketListener&) = delete;
  PacketListener& operator=(const PacketListener&) = delete;
  ~PacketListener();

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  /// Nothing: nobody is waiting.
  [[nodiscard]] Result<std::optional<PacketSocket>> accept();

 private:
  PacketListener(UniqueFd fd, std::string path, ino_t inode)
      : fd_(std::move(fd)), path_(std::move(path)), inode_(inode) {}
  void remove_file() noexcept;

  UniqueFd fd_;
  std::string path_;
  ino_t inode_ = 0;  // of the socket file
};

}  // namespace plchost
