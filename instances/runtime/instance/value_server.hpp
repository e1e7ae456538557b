#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "instances/runtime/instance/packet_server.hpp"
#include "instances/runtime/variables/variable_service.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/variables/value_message.hpp"

namespace plchost {

/// The instance's socket for values: see shm/variables/value_message.hpp. A connection has one request at a
/// time; requests of several are answered from one sample. A packet that is no request gets a reply that
/// says so, and the connection is closed. Control thread.
class ValueServer {
 public:
  static constexpr std::size_t kMaxConnections = 8;
  /// The least time between two samples: so that clients who ask without a pause do not hold the tasks up.
  static constexpr Duration kPause = std::chrono::milliseconds(1);

  [[nodiscard]] static Result<ValueServer> listen(const std::string& path, const VariableService& variables);

  /// Readable when serve() has something to do.
  [[nodiscard]] int fd() const noexcept { return server_.fd(); }
  void serve();
  void beat() { server_.beat(); }

  /// Calls an action in a moment in which no task is within a cycle. False: there is none now, nothing was
  /// called.
  using Moment = std::function<bool(const std::function<void()>&)>;
  /// Answers the requests that wait, if `moment` finds one or their time is over. `later`: false: no moment
  /// will come, so nobody waits for one.
  void advance(const Moment& moment, bool later);
  [[nodiscard]] bool has_work() const noexcept { return !waiting_.empty(); }

 private:
  struct Waiting {
    std::uint64_t connection = 0;
    ValueRequest request;
    TimePoint limit;
    SamplePlan plan = {};
    ValueReply reply = {};
  };

  ValueServer(PacketServer server, const VariableService& variables)
      : server_(std::move(server)), variables_(&variables) {}
  [[nodiscard]] bool take(std::uint64_t connection, const Result<std::string>& packet);
  void refuse(std::uint64_t connection, std::uint64_t number, ErrorCode code);
  void prepare();
  void sample(bool consistent) noexcept;

  PacketServer server_;
  const VariableService* variables_;
  std::deque<Waiting> waiting_;
  TimePoint next_;  // not before this
};

}  // namespace plchost
