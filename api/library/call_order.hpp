#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>

#include "api/client/async.hpp"
#include "api/client/client_core.hpp"
#include "api/client/turns.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The calls of one Client to one host go one after the other, in the order in which they were begun. Those
/// to other hosts go at the same time. One thread, but for end().
class CallOrder {
 public:
  explicit CallOrder(Duration timeout) noexcept : timeout_(timeout) {}

  [[nodiscard]] Duration timeout() const noexcept { return timeout_; }
  [[nodiscard]] TimePoint deadline() const { return MonotonicClock::now() + timeout_; }

  /// The host of a call whose turn has come.
  struct Place {
    std::string host;
    std::unique_ptr<Turns::Turn> turn;
    TimePoint deadline;  ///< from now on

    /// The calls behind this one need not wait for its end.
    void let_others_go() { turn.reset(); }
  };
  /// Waits for the host, and for the calls to it that were begun before. `name`: empty: the one that the
  /// Client is for, or the only one. unavailable: end() was called.
  Async<Result<Place>> place(ClientCore& core, std::string name);

  /// Downloads to one host, which hold up no other call, but each other.
  [[nodiscard]] Turns& downloads(const std::string& host) { return downloads_[host]; }

  /// No turn comes any more.
  void end() noexcept { ended_.store(true); }

 private:
  Duration timeout_;
  std::map<std::string, Turns> turns_;  // by host
  std::map<std::string, Turns> downloads_;
  std::atomic<bool> ended_{false};
};

/// Said of calls of a Client that has ended.
[[nodiscard]] std::unexpected<Error> client_has_ended();

}  // namespace plchost
