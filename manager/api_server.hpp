#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "manager/config/manager_config.hpp"
#include "manager/supervisor/heartbeat_watch.hpp"
#include "manager/system/child_process.hpp"
#include "manager/system/reactor.hpp"

namespace plchost {

/// Keeps `plchost-dds` alive: started again at once when it ends, and with back-off when it keeps ending;
/// killed when its loop stands still. It finds the manager by its control socket, and ends by itself when
/// that closes. When another host of the domain has this host's name, it is started again from time to time
/// only, to see whether it still has.
class ApiServer {
 public:
  ApiServer(Reactor& reactor, const ManagerConfig& config, std::string program);

  void start();
  /// SIGTERM, SIGKILL after a limit; `done` when it is gone, possibly at once.
  void shut_down(std::function<void()> done);

 private:
  void spawn();
  void ended();
  void on_timer();
  void name_is_taken(TimePoint now);
  void look_at_beats();
  /// Whether it has beaten since the last look.
  [[nodiscard]] bool beats_since() const;
  [[nodiscard]] bool has_served() const;
  [[nodiscard]] std::vector<std::string> arguments() const;

  Reactor& reactor_;
  const ManagerConfig& config_;
  std::string program_;
  std::optional<ChildProcess> process_;
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
  std::function<void()> shut_down_;
};

/// Of the second and later restarts in a row: doubles from the first to the second.
inline constexpr Duration kApiRestartDelay = std::chrono::milliseconds(100);
inline constexpr Duration kApiRestartDelayMax = std::chrono::seconds(5);
/// Whose loop stands still for so long is killed. It beats every 25 ms.
inline constexpr Duration kApiSilence = std::chrono::seconds(10);
/// So long may its start take: it may have to wait for the end of the one before, and for its name.
inline constexpr Duration kApiStart = std::chrono::seconds(30);
/// Of those that were refused the name: doubles from the first to the second.
inline constexpr Duration kNameDelay = std::chrono::seconds(5);
inline constexpr Duration kNameDelayMax = std::chrono::seconds(60);
/// Who lived that long has the name of the host: it has asked for it for less than that.
inline constexpr Duration kNameAsked = std::chrono::seconds(3);
/// Who lived that long has recovered: its next restart is at once.
inline constexpr Duration kApiSettled = std::chrono::seconds(1);
/// And who has served at all, after so long at most: what ends each one again and again (packets) shall not
/// keep the host away for longer than that.
inline constexpr Duration kApiServedDelay = std::chrono::milliseconds(50);

}  // namespace plchost
