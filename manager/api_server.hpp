#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "manager/config/manager_config.hpp"
#include "manager/supervisor/heartbeat_watch.hpp"
#include "manager/system/child_process.hpp"
#include "manager/system/reactor.hpp"

namespace plchost {

/// Of the server's log of changes.
[[nodiscard]] std::string audit_folder(const HostConfig& host);

/// Keeps `plchost-dds` running: started again at once when it ends, and with back-off when it keeps ending;
/// killed when its loop stands still. It finds the manager by its control socket, and ends by itself when
/// that closes. When another host of the domain has this host's name, it is started again from time to time
/// only, to see whether it still has.
class ApiServer {
 public:
  /// `is_asked`: a command that came over it is not answered yet. All outlive it.
  ApiServer(Reactor& reactor, const ManagerConfig& config, std::string program,
            std::function<bool()> is_asked);

  /// If the configuration has enabled it.
  void start();
  /// The configuration is another one: ends the process and starts one with that, when commands are answered,
  /// kRenewLimit later at most.
  void renew();
  /// Nothing: there is none.
  [[nodiscard]] std::optional<int> process() const {
    return process_ ? std::optional(process_->pid) : std::nullopt;
  }
  /// SIGTERM, SIGKILL after a limit; `done` when it is gone, possibly at once.
  void shut_down(std::function<void()> done);

 private:
  void spawn();
  void give_ledger() const;
  void ended();
  void on_timer();
  void name_is_taken(TimePoint now);
  void look_whether_answered();
  void begin_anew();
  void look_at_beats();
  /// Whether it has beaten since the last look.
  [[nodiscard]] bool beats_since() const;
  [[nodiscard]] bool has_served() const;
  [[nodiscard]] std::vector<std::string> arguments() const;
  void signal(const ChildProcess& process, int signal) const;

  Reactor& reactor_;
  const ManagerConfig& config_;
  std::string program_;
  std::function<bool()> is_asked_;
  std::optional<ChildProcess> process_;
  std::optional<uid_t> user_;  ///< of its own
  Reactor::Watch exit_watch_;
  Reactor::Timer timer_;
  Reactor::Timer beat_timer_;
  UniqueFd beats_;  ///< an eventfd that its loop counts up
  std::int64_t beats_counted_ = 0;
  HeartbeatWatch heartbeat_;
  TimePoint spawned_{};
  Duration delay_{};
  std::int64_t name_since_ns_ = 0;  ///< 0: nobody has asked for the name yet
  bool name_held_ = false;          ///< a server that has ended had it
  Duration name_delay_{};           ///< not 0: another host has the name
  Reactor::Timer renew_timer_;
  TimePoint renew_until_{};
  int quiet_looks_ = 0;    ///< of look_whether_answered(), in a row
  bool renewing_ = false;  ///< the process was asked to end, and another one follows
  /// Of the network that the last server was started for.
  DdsConfig network_;
  int domain_ = 0;
  std::function<void()> shut_down_;
};

/// Of the second and later restarts in a row: doubles from the first to the second.
inline constexpr Duration kApiRestartDelay = std::chrono::milliseconds(100);
inline constexpr Duration kApiRestartDelayMax = std::chrono::seconds(5);
/// A changed configuration waits so long at most for the answers of commands.
inline constexpr Duration kRenewLimit = std::chrono::seconds(45);
/// The manager kills an API server whose loop stands still for so long. It beats every 25 ms.
inline constexpr Duration kApiSilence = std::chrono::seconds(10);
/// So long may its start take: it may have to wait for the end of the one before, and for its name.
inline constexpr Duration kApiStart = std::chrono::seconds(30);
/// Of those that were refused the name: doubles from the first to the second.
inline constexpr Duration kNameDelay = std::chrono::seconds(5);
inline constexpr Duration kNameDelayMax = std::chrono::seconds(60);
/// An API server that serves, and has run for so long, has the name of the host. It is looked at so often.
inline constexpr Duration kNameAsked = std::chrono::seconds(3);
/// An API server that ran for so long has recovered: its next restart has no delay.
inline constexpr Duration kApiSettled = std::chrono::seconds(1);
/// The longest delay after one that has served at all: packets that end each one again and again shall not
/// keep the host away for longer than that.
inline constexpr Duration kApiServedDelay = std::chrono::milliseconds(50);

}  // namespace plchost
