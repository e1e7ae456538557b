#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "manager/system/child_process.hpp"
#include "manager/system/reactor.hpp"
#include "shm/base/result.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// One file to be written as a whole, for good.
struct WishOrder {
  enum class Kind : std::uint8_t {
    whole,       ///< see text and from
    exceptions,  ///< those in `from` are added to those in `path`: see keep_exceptions_on_disk()
  };
  Kind kind = Kind::whole;
  std::string path;  ///< its folder is made if it is missing
  std::string text;  ///< the wanted contents
  std::string from;  ///< not empty: it is to be a copy of this file instead, and is removed if there is none
};

/// Writes small files from a helper process, because a disk may keep a writer waiting for minutes and the
/// manager must not wait. The helper starts with the first order and ends with the manager.
class WishWriter {
 public:
  using Done = std::function<void(const Result<void>& written)>;

  /// `helper`: path of plchostd.
  WishWriter(Reactor& reactor, std::string helper) : reactor_(reactor), helper_(std::move(helper)) {}

  /// `done` is called later, once; not if this returns an error.
  [[nodiscard]] Result<void> write(const WishOrder& order, Done done);
  /// Of the helper; nothing: it does not run.
  [[nodiscard]] std::optional<int> process() const {
    return process_ ? std::optional(process_->pid) : std::nullopt;
  }

 private:
  [[nodiscard]] Result<void> start();
  void read_answers();
  void ended();

  Reactor& reactor_;
  std::string helper_;
  std::optional<ChildProcess> process_;
  Reactor::Watch exit_watch_;
  PacketSocket link_;
  Reactor::Watch link_watch_;
  std::uint64_t last_number_ = 0;
  std::map<std::uint64_t, Done> waiting_;
};

/// The command line that makes plchostd the helper.
inline constexpr const char* kWishWriterOption = "--write-wishes";

/// main() of the helper: takes orders from kChildReportFd until the manager is gone.
[[nodiscard]] int wish_writer_main();

}  // namespace plchost
