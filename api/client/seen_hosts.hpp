#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <control.h>
#include <dds/dds.h>

#include "api/client/host_clock.hpp"
#include "api/client/newest_epoch.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The values of a host's presence.
struct SeenHost {
  NewestEpoch server;  ///< that shows its presence
  std::int32_t pid = 0;
  dds_instance_handle_t writer = DDS_HANDLE_NIL;  ///< of the presence
  HostClock clock;
  std::uint32_t others = 0;  ///< presences of an older server while this one runs
  TimePoint other_last;
};

/// The hosts that have shown their presence, by name. Unsecured, anyone can write names: beyond kMost those
/// that were not seen for kForgotten make room, and while there are none, new ones are not seen.
class SeenHosts {
 public:
  static constexpr std::size_t kMost = 1024;
  static constexpr Duration kForgotten = std::chrono::minutes(1);

  /// A server that was replaced has ended when it has been silent for so long.
  static constexpr Duration kEnded = std::chrono::milliseconds(200);

  /// True: news; that host, or that server of it, was not there before. `writer`: of the presence.
  bool take(const plc_Presence& presence, TimePoint now, dds_instance_handle_t writer = DDS_HANDLE_NIL);
  /// The writers of servers that were replaced and have ended, each once.
  [[nodiscard]] std::vector<dds_instance_handle_t> take_ended(TimePoint now);
  /// nullptr: never seen, or forgotten.
  [[nodiscard]] const SeenHost* find(std::string_view name) const;
  [[nodiscard]] const std::map<std::string, SeenHost, std::less<>>& all() const noexcept { return hosts_; }

 private:
  [[nodiscard]] SeenHost* find_or_add(std::string_view name, TimePoint now);

  /// A server before the present one.
  struct Replaced {
    dds_instance_handle_t writer = DDS_HANDLE_NIL;
    TimePoint last;
  };
  static constexpr std::size_t kMostReplaced = 64;

  std::map<std::string, SeenHost, std::less<>> hosts_;
  std::vector<Replaced> replaced_;
};

}  // namespace plchost
