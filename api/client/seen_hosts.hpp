#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include <control.h>

#include "api/client/host_clock.hpp"
#include "api/client/newest_epoch.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// What a host's presence has told.
struct SeenHost {
  std::uint64_t epoch = 0;
  std::int32_t pid = 0;
  TimePoint last;
  HostClock clock;
  std::uint32_t others = 0;  ///< presences of an older server while this one lives
  TimePoint other_last;
};

/// The hosts that have shown their presence, by name. Unsecured, anyone can write names: beyond kMost those
/// that were not seen for kForgotten make room, and while there are none, new ones are not seen.
class SeenHosts {
 public:
  static constexpr std::size_t kMost = 1024;
  static constexpr Duration kForgotten = std::chrono::minutes(1);

  /// True: news; that host, or that server of it, was not there before.
  bool take(const plc_Presence& presence, TimePoint now);
  /// nullptr: never seen, or forgotten.
  [[nodiscard]] const SeenHost* find(std::string_view name) const;
  [[nodiscard]] const std::map<std::string, SeenHost, std::less<>>& all() const noexcept { return hosts_; }

 private:
  [[nodiscard]] SeenHost* find_or_add(std::string_view name, TimePoint now);

  std::map<std::string, SeenHost, std::less<>> hosts_;
};

}  // namespace plchost
