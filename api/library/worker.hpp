#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "api/library/connection.hpp"
#include "api/library/maker_process.hpp"

namespace plchost {

/// Does the calls of one Client, one after the other, on a thread of its own.
class __attribute__((visibility("hidden"))) Client::Worker {
 public:
  /// A call: with the connection, or with why there is none.
  using Job = std::function<void(const Result<ControlClient*>&)>;

  Worker(const Options& options, std::shared_ptr<ParticipantSource> participant);
  ~Worker() { end(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// In a child of fork() nothing of it may be touched, not even destroyed.
  [[nodiscard]] const MakerProcess& maker() const noexcept { return maker_; }
  [[nodiscard]] Duration timeout() const noexcept { return timeout_; }
  [[nodiscard]] TimePoint deadline() const { return MonotonicClock::now() + timeout_; }

  /// How many calls may wait for those before them.
  static constexpr std::size_t kMaxJobs = 1024;

  /// ClientError: invalid_argument: there cannot be a host of that name, or the Client is for another one.
  void check_watched(const std::string& host) const;

  /// Waits for the job that is under way; those that were not begun, and all that come, are called with
  /// `unavailable`. Not from a job.
  void end();
  /// `job` is called later, or, if too many wait (full) or the client has ended, within this call.
  void begin(Job job);
  /// Tells `progress`. It is called in the middle of a call, which uses the ControlClient: run() refuses
  /// meanwhile.
  [[nodiscard]] Progress refusing(const Progress& progress);
  /// Returns what `call(client)` returns. From a callback: at once, it is this thread's turn.
  template <class T>
  [[nodiscard]] Result<T> run(const std::function<Result<T>(ControlClient&)>& call) {
    std::promise<Result<T>> promise;
    const Job job = [&](const Result<ControlClient*>& client) {
      promise.set_value(client ? call(**client) : Result<T>(std::unexpected(client.error())));
    };
    if (std::this_thread::get_id() == thread_.get_id()) {
      job(telling_ ? busy() : connection_.client());
    } else {
      begin(job);
    }
    return promise.get_future().get();
  }

 private:
  void work();
  [[nodiscard]] static Result<ControlClient*> busy();

  MakerProcess maker_;
  Connection connection_;
  Duration timeout_;
  std::string only_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool ending_ = false;
  bool telling_ = false;  // progress; of the thread
  std::thread thread_;
};

}  // namespace plchost
