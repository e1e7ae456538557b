#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "api/client/async.hpp"
#include "api/library/call_order.hpp"
#include "api/library/connection.hpp"
#include "api/library/maker_process.hpp"

namespace plchost {

/// Does the calls of one Client on a thread of its own: many at the same time, those to one host in their
/// turn.
class __attribute__((visibility("hidden"))) Client::Worker {
 public:
  Worker(const Options& options, std::shared_ptr<ParticipantSource> participant);
  ~Worker() { end(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// In a child of fork() nothing of it may be touched, not even destroyed.
  [[nodiscard]] const MakerProcess& maker() const noexcept { return maker_; }
  [[nodiscard]] CallOrder& order() noexcept { return order_; }

  /// How many calls there may be.
  static constexpr std::size_t kMaxCalls = 1024;

  /// ClientError: invalid_argument: there cannot be a host of that name, or the Client is for another one.
  void check_watched(const std::string& host) const;

  /// Waits for the calls that are under way; those whose turn had not come, and all that come, fail with
  /// `unavailable`. Not from a callback.
  void end();

  template <class T>
  using Call = std::function<Async<Result<T>>(ClientCore&)>;
  template <class T>
  using Done = std::function<void(Result<T>)>;

  /// `done` is told later, or, if there are too many calls (full) or the client has ended, within this call.
  template <class T>
  void begin(Call<T> call, Done<T> done) {
    begin([this, call = std::move(call), done = std::move(done)](const Result<ControlClient*>& client) {
      return client ? tell<T>((*client)->core().pump(), call((*client)->core()), done)
                    : fail<T>(client.error(), done);
    });
  }
  /// Waits for it. From a callback, other calls go on meanwhile.
  template <class T>
  [[nodiscard]] Result<T> run(const Call<T>& call) {
    if (std::this_thread::get_id() == thread_.get_id()) return run_here(call);
    std::promise<Result<T>> promise;
    begin<T>(call, [&](Result<T> result) { promise.set_value(std::move(result)); });
    return promise.get_future().get();
  }

 private:
  struct Over {};
  using Job = std::function<Async<Over>(const Result<ControlClient*>&)>;
  // A callback that waits for a call lets others go on, but no other callback is told within it.
  template <class T>
  Async<Over> tell(Pump& pump, Async<Result<T>> call, Done<T> done) {
    auto result = co_await call;
    while (telling_) co_await pump.change(kNoDeadline);
    telling_ = true;
    done(std::move(result));
    telling_ = false;
    pump.look_again();
    co_return Over();
  }
  template <class T>
  static Async<Over> fail(Error error, Done<T> done) {
    done(std::unexpected(std::move(error)));
    co_return Over();
  }
  template <class T>
  [[nodiscard]] Result<T> run_here(const Call<T>& call) {
    PLCHOST_TRY_ASSIGN(ControlClient* const client, connect());
    Async<Result<T>> own = call(client->core());
    own.start();
    while (!own.done()) step();
    return own.take();
  }

  void begin(Job job);
  /// With the mutex.
  void wake();
  void work();
  [[nodiscard]] Result<ControlClient*> connect();
  [[nodiscard]] bool is_ending();
  /// Begins the calls that have come, and goes on with those that are under way. False: there are none.
  bool step();
  bool begin_next();

  MakerProcess maker_;
  Connection connection_;
  CallOrder order_;
  std::string only_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;             // not begun
  std::size_t calls_ = 0;            // those and the ones under way
  ControlClient* client_ = nullptr;  // that of the connection, once it is there
  bool ending_ = false;
  bool telling_ = false;  // a callback runs; of the thread
  std::list<Async<Over>> under_way_;
  std::thread thread_;
};

}  // namespace plchost
