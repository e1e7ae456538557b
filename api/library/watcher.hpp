#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "api/library/connection.hpp"
#include "api/library/maker_process.hpp"
#include "api/library/sampling.hpp"

namespace plchost {

/// The news of a Watcher.
struct News {
  ControlClient& client;
  const std::vector<TransitionView>& fresh;  ///< changes of state since the last time
  const std::vector<TransitionView>& kept;   ///< the last ones, those included
};

/// The callbacks of one Watch.
class __attribute__((visibility("hidden"))) Client::Watch::Subscription {
 public:
  Subscription() = default;
  virtual ~Subscription() = default;
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;

  /// No callback after this. Any thread.
  void stop() noexcept;
  [[nodiscard]] bool stopped() const noexcept { return stopped_.load(); }

 protected:
  /// Calls back by `call`, unless it was stopped. stop() waits for the end of that.
  void unless_stopped(const std::function<void()>& call);

 private:
  MakerProcess maker_;
  std::recursive_mutex calling_;  // a callback may stop its own watch
  std::atomic<bool> stopped_{false};
};

/// One that a Watcher looks for.
class __attribute__((visibility("hidden"))) Client::LookingWatch : public Client::Watch::Subscription {
 public:
  [[nodiscard]] virtual bool wants_transitions() const noexcept { return false; }
  /// Watcher's thread.
  void look(const News& news) {
    unless_stopped([&] { tell(news); });
  }

 protected:
  virtual void tell(const News& news) = 0;
};

/// Looks for what watches want to be told, on a thread and with a ControlClient of its own: a call that waits
/// holds up no watch. The thread waits for DDS, and looks when something has changed.
class __attribute__((visibility("hidden"))) Client::Watcher {
 public:
  /// `only`: as for ControlClient.
  Watcher(const std::shared_ptr<ParticipantSource>& participant, const std::string& only)
      : connection_(participant, only), sampling_(participant, only) {}
  ~Watcher() { end(); }
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;

  /// Nothing is told after this. Not from a callback.
  void end();
  /// Its thread starts with the first.
  void add(std::shared_ptr<LookingWatch> subscription);
  /// For the watches of variables.
  [[nodiscard]] Sampling& sampling() noexcept { return sampling_; }

 private:
  using Subscriptions = std::vector<std::shared_ptr<LookingWatch>>;
  void watch();
  /// Those that are there, once there are some. Nothing: it ends.
  [[nodiscard]] std::optional<Subscriptions> wait_for_live();
  /// Makes the ControlClient if there is none. True: it is new.
  [[nodiscard]] bool connect();
  /// Ends all waits of the thread. With the mutex.
  void wake();
  void look(ControlClient& client, const Subscriptions& subscriptions);
  void keep(const std::vector<TransitionView>& fresh);

  Connection connection_;
  Sampling sampling_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Subscriptions subscriptions_;
  bool has_new_ = false;                     // of them, since the last look
  ControlClient* client_ = nullptr;          // that of the connection, once it is there
  std::vector<TransitionView> transitions_;  // for watches that come later: the kept samples of hosts come
                                             // only once
  std::optional<std::uint64_t> looked_;      // ControlClient::changes() at the last look
  // Since the first watch of them, also after the last: a later one is told those that came meanwhile.
  bool takes_transitions_ = false;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace plchost
