#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "api/library/connection.hpp"

namespace plchost {

/// Asks hosts again and again, on a thread and with a ControlClient of its own: no call and no watch of the
/// status holds up a sample.
class Sampling {
 public:
  struct Over {};
  /// Asks, until it has enough.
  using Asking = std::function<Async<Over>(ClientCore&)>;

  /// `only`: as for ControlClient.
  Sampling(std::shared_ptr<ParticipantSource> participant, std::string only)
      : connection_(std::move(participant), std::move(only)) {}
  ~Sampling() { end(); }
  Sampling(const Sampling&) = delete;
  Sampling& operator=(const Sampling&) = delete;

  /// Those that ask end where they are. Not from one of them.
  void end();
  /// Its thread starts with the first. An asking that never begins, or that ends where it is, is destroyed.
  void begin(Asking asking);
  /// Whether this is its thread.
  [[nodiscard]] bool is_here();

 private:
  void work();
  /// Those that are to begin, at once or when there are some. Nothing: it ends.
  [[nodiscard]] std::optional<std::vector<Asking>> take_new(bool wait);
  /// As soon as that is possible. nullptr: it ends before.
  [[nodiscard]] ControlClient* connect();

  Connection connection_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Asking> new_;
  ControlClient* client_ = nullptr;  // that of the connection, once it is there
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace plchost
