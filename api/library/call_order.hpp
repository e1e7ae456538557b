#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "api/client/async.hpp"
#include "api/client/client_core.hpp"
#include "api/client/turns.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The calls of one Client to one host go one after the other, in the order in which they were begun. Those
/// to other hosts go at the same time. A call that names no host may be for any host until that is known, so
/// the calls behind it wait until then. One thread, but for end().
class CallOrder {
 public:
  explicit CallOrder(Duration timeout) noexcept : timeout_(timeout) {}

  [[nodiscard]] Duration timeout() const noexcept { return timeout_; }
  [[nodiscard]] TimePoint deadline() const { return MonotonicClock::now() + timeout_; }

  /// One call's place in the order, until it is destroyed.
  class Turn {
   public:
    /// `host`: empty: not known yet.
    Turn(CallOrder& order, Pump& pump, std::string host);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    /// The host that it is for, once that is known. It keeps its place.
    void set_host(const std::string& host);
    [[nodiscard]] bool has_come() const;
    /// co_await it while it has not come: until then, or until the deadline.
    [[nodiscard]] Pump::Change come(TimePoint deadline) noexcept { return hold_.released(deadline); }

   private:
    friend class CallOrder;
    void leave();
    CallOrder& order_;
    std::uint64_t number_;
    std::string host_;
    Pump::Hold hold_;
  };

  /// The host of a call whose turn has come.
  struct Place {
    std::string host;
    std::unique_ptr<Turn> turn;
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
  [[nodiscard]] bool has_ended() const noexcept { return ended_.load(); }

 private:
  using Line = std::map<std::uint64_t, Turn*>;  // by number
  static void release_first(const Line& line);
  Async<Result<std::string>> host_in_turn(ClientCore& core, std::string name, Turn& turn);

  Duration timeout_;
  std::uint64_t last_ = 0;
  std::map<std::string, Line> lines_;  // by host; none is empty
  Line unknown_;                       // of those whose hosts are not known yet
  std::map<std::string, Turns> downloads_;
  std::atomic<bool> ended_{false};
};

/// Said of calls of a Client that has ended.
[[nodiscard]] std::unexpected<Error> client_has_ended();

}  // namespace plchost
