#pragma once

#include <string>
#include <string_view>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost::bench {

/// The traffic of a network interface since it was made. An Ethernet frame counts as a datagram, so a
/// longer datagram counts once for each of its fragments.
struct Traffic {
  double received_bytes = 0;
  double received_datagrams = 0;
  double sent_bytes = 0;
  double sent_datagrams = 0;

  friend Traffic operator-(const Traffic& now, const Traffic& before) noexcept {
    return {now.received_bytes - before.received_bytes, now.received_datagrams - before.received_datagrams,
            now.sent_bytes - before.sent_bytes, now.sent_datagrams - before.sent_datagrams};
  }
};

/// The counters of one interface in the text of /proc/net/dev. not_found: it has no such interface.
[[nodiscard]] Result<Traffic> parse_traffic(std::string_view text, std::string_view interface);

/// A network namespace without a name: it ends with this object and the last process within it, also when the
/// benchmark is killed. So do its interfaces.
class NetworkSpace {
 public:
  /// refused: this process may make none.
  [[nodiscard]] static Result<NetworkSpace> create();

  /// A path by which `ip` can put an interface into it, as long as this object exists.
  [[nodiscard]] std::string path() const;

  /// The calling thread, and what it starts, is within the space until this goes.
  class Visit {
   public:
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;
    Visit(Visit&&) noexcept = default;
    Visit& operator=(Visit&&) = delete;
    ~Visit();

   private:
    friend class NetworkSpace;
    explicit Visit(UniqueFd home) noexcept : home_(std::move(home)) {}
    UniqueFd home_;
  };
  [[nodiscard]] Result<Visit> enter() const;

  [[nodiscard]] Result<Traffic> traffic(std::string_view interface) const;

 private:
  explicit NetworkSpace(UniqueFd space) noexcept : space_(std::move(space)) {}
  UniqueFd space_;
};

}  // namespace plchost::bench
