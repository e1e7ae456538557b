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
#include <vector>

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

  enum class Telling : std::uint8_t {
    in_turn,  ///< after all that is to be told, which may be callbacks that wait
    at_once,  ///< of one that only wakes a thread
  };

  /// `done` is told later, or, if there are too many calls (full) or the client has ended, within this call.
  /// The call has freed its place then. All that is told in turn is told one after the other.
  template <class T>
  void begin(Call<T> call, Done<T> done, Telling telling = Telling::in_turn) {
    begin({.start =
               [this, call = std::move(call), done, telling](ClientCore& core) {
                 const auto here = under_way_.emplace(under_way_.end());
                 *here = see_to_end<T>(call(core), done, telling, here);
                 here->start();
               },
           .fail = [done](Error error) { done(std::unexpected(std::move(error))); },
           .telling = telling});
  }
  /// Waits for it. From a callback, other calls go on meanwhile, and what they tell waits.
  template <class T>
  [[nodiscard]] Result<T> run(const Call<T>& call, Telling telling = Telling::at_once) {
    if (is_here()) return run_here(call);
    std::promise<Result<T>> promise;
    begin<T>(call, [&](Result<T> result) { promise.set_value(std::move(result)); }, telling);
    return promise.get_future().get();
  }

  /// Whether this is the thread of the callbacks.
  [[nodiscard]] bool is_here() const noexcept { return std::this_thread::get_id() == thread_.get_id(); }
  /// Tells `progress` in its turn among all that is told: the newest number of bytes then.
  [[nodiscard]] Progress in_turn(Progress progress);

 private:
  struct Over {};
  using UnderWay = std::list<Async<Over>>;
  struct Job {
    std::function<void(ClientCore&)> start;
    std::function<void(Error)> fail;
    Telling telling = Telling::in_turn;
  };
  void tell(Telling telling, std::function<void()> what);
  /// Notes that a call is over, however it ends.
  struct Ending {
    std::vector<UnderWay::iterator>& over;
    UnderWay::iterator here;
    ~Ending() { over.push_back(here); }
  };
  template <class T>
  Async<Over> see_to_end(Async<Result<T>> call, Done<T> done, Telling telling, UnderWay::iterator here) {
    const Ending ending{over_, here};
    auto result = co_await call;
    tell(telling, [this, done = std::move(done), result = std::move(result)]() mutable {
      free_place();
      done(std::move(result));
    });
    co_return Over();
  }
  template <class T>
  [[nodiscard]] Result<T> run_here(const Call<T>& call) {
    PLCHOST_TRY_ASSIGN(ControlClient* const client, connect());
    begin_all();  // the callback may have begun calls before this one
    Async<Result<T>> own = call(client->core());
    own.start();
    while (!own.done()) {
      round(TimePoint::max());
      begin_all();
    }
    return own.take();
  }

  void begin(Job job);
  /// With the mutex.
  void wake();
  void work();
  [[nodiscard]] Result<ControlClient*> connect();
  [[nodiscard]] bool is_ending();
  [[nodiscard]] bool has_jobs();
  void free_place();
  /// Begins the calls that have come, tells what is to be told, and goes on with the calls that are under
  /// way. False: there was nothing of these.
  bool step();
  void begin_all();
  void tell_all();
  void round(TimePoint deadline);
  void forget_ended();

  MakerProcess maker_;
  Connection connection_;
  CallOrder order_;
  std::string only_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;             // not begun
  std::size_t calls_ = 0;            // that have come and are not told
  ControlClient* client_ = nullptr;  // that of the connection, once it is there
  bool ending_ = false;
  // Of the thread.
  std::deque<std::function<void()>> to_tell_;  // callbacks
  std::vector<UnderWay::iterator> over_;       // of those under way
  UnderWay under_way_;
  std::thread thread_;
};

}  // namespace plchost
