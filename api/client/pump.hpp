#pragma once

#include <coroutine>
#include <deque>
#include <functional>
#include <map>
#include <utility>

#include "api/client/async.hpp"
#include "api/client/wait_set.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Lets operations wait for what comes over DDS, many at a time on one thread. A round takes all that has
/// come, and then each operation that waits for it goes on, in the order in which they began to wait. An
/// operation may itself run others to their end: those that wait go on meanwhile. Operations that wait for
/// others of this thread have a Hold: a round costs nothing for them.
class Pump {
 public:
  /// `take`: takes what has come; told whether several operations wait for it.
  Pump(WaitSet set, std::function<void(bool several)> take) : set_(std::move(set)), take_(std::move(take)) {}
  Pump(const Pump&) = delete;
  Pump& operator=(const Pump&) = delete;

  [[nodiscard]] const WaitSet& set() const noexcept { return set_; }

  class Change;
  class Hold;
  /// co_await it: goes on at the deadline at the latest, and earlier when something has been taken, or
  /// without cause: look again. Look before the first wait and after each.
  [[nodiscard]] Change change(TimePoint deadline) noexcept;
  /// Operations that have looked in this round look once more: another one has taken something, or given it
  /// back.
  void look_again() noexcept { again_ = again_ || !waiting_.empty(); }

  /// Sleeps until something has come, set().wake() was called, an operation's wait ends, or the deadline is
  /// there; takes it, and lets all operations go on.
  void round(TimePoint deadline);
  /// Runs it to its end, and the others meanwhile.
  template <class T>
  [[nodiscard]] T complete(Async<T> operation) {
    operation.start();
    while (!operation.done()) round(TimePoint::max());
    return operation.take();
  }

 private:
  using Held = std::multimap<TimePoint, Hold*>;  // by deadline
  void begin(Change& change);
  void end(const Change& change) noexcept;
  void release(Hold& hold);
  void release_overdue();

  WaitSet set_;
  std::function<void(bool)> take_;
  std::deque<Change*> waiting_;  // for what comes
  Held held_;
  std::deque<Change*> due_;  // of this round, which an inner one goes on with
  int rounds_ = 0;           // this one, and those within operations of it
  bool again_ = false;
};

/// Where one operation waits for others of this thread.
class Pump::Hold {
 public:
  explicit Hold(Pump& pump) noexcept : pump_(pump) {}
  Hold(const Hold&) = delete;
  Hold& operator=(const Hold&) = delete;

  /// co_await it: goes on after release(), and at the deadline at the latest. Look before and after.
  [[nodiscard]] Change released(TimePoint deadline) noexcept;
  /// If the operation waits, it goes on in this round, or in the next one.
  void release() {
    if (change_ != nullptr) pump_.release(*this);
  }

 private:
  friend class Pump;
  Pump& pump_;
  Change* change_ = nullptr;  // that waits
  Held::iterator place_;      // as long as it does
};

/// The wait of one operation. It is forgotten when the operation is destroyed.
class Pump::Change {
 public:
  Change(Pump& pump, TimePoint deadline, Hold* hold) noexcept
      : pump_(pump), deadline_(deadline), hold_(hold) {}
  Change(const Change&) = delete;
  Change& operator=(const Change&) = delete;
  ~Change() {
    if (handle_) pump_.end(*this);
  }

  bool await_ready() const noexcept { return false; }
  void await_suspend(std::coroutine_handle<> operation) {
    handle_ = operation;
    pump_.begin(*this);
  }
  void await_resume() noexcept {}

 private:
  friend class Pump;
  Pump& pump_;
  TimePoint deadline_;
  Hold* hold_;  // nullptr: it waits for what comes
  std::coroutine_handle<> handle_;
};

inline Pump::Change Pump::change(TimePoint deadline) noexcept {
  return {*this, deadline, nullptr};
}

inline Pump::Change Pump::Hold::released(TimePoint deadline) noexcept {
  return {pump_, deadline, this};
}

}  // namespace plchost
