#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "api/client/newest_epoch.hpp"
#include "api/dds/guid.hpp"
#include "shm/base/time.hpp"
#include "shm/block_driver/directory_layout.hpp"

namespace plchost {

/// A host's claims to other hosts.
struct HostClaim {
  std::string host;
  std::uint16_t number = 0;   ///< 1 to kMaxHostNumber
  std::int64_t since_ns = 0;  ///< start of its manager, CLOCK_REALTIME
  std::uint64_t epoch = 0;
  dds::Guid participant;

  bool operator==(const HostClaim&) const = default;
};

/// The host of each number. Of those that claim the same one, the host whose manager started first has it.
/// One thread.
class HostNumbers {
 public:
  /// A host that did not have its number gets it so long after the last other one has gone: a server that was
  /// killed is back sooner.
  static constexpr Duration kGrace = std::chrono::seconds(5);

  explicit HostNumbers(HostClaim own) : own_(std::move(own)) {}

  /// Ignored: of this host, of a number that cannot be, or of a server that was replaced (NewestEpoch).
  void claim(const HostClaim& other, TimePoint now);
  void forget(const std::string& host, TimePoint now);

  /// The other hosts that have their numbers, by number.
  [[nodiscard]] std::map<std::uint16_t, HostClaim> others() const;
  /// The other host that has this one's number. It serves no blocks while there is one.
  [[nodiscard]] std::optional<HostClaim> ahead() const;
  /// Whether this host has its number.
  [[nodiscard]] bool serves(TimePoint now) const {
    return !ahead() && (!last_ahead_ || now - *last_ahead_ > kGrace);
  }
  /// Hosts that claim this one's number and do not have it.
  [[nodiscard]] std::vector<HostClaim> behind() const;

 private:
  HostClaim own_;
  std::map<std::string, HostClaim> claims_;
  std::map<std::string, NewestEpoch> epochs_;  // of the same hosts
  std::optional<TimePoint> last_ahead_;
};

/// The numbers in so few ranges as a directory has room for: if there are more, with the smallest gaps
/// filled.
[[nodiscard]] std::vector<HostRange> ranges_of(const std::vector<std::uint16_t>& sorted_numbers);

}  // namespace plchost
