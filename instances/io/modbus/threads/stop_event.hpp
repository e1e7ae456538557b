#pragma once

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost::modbus {

/// Ends the waits of all threads of this process. Any thread.
class StopEvent {
 public:
  [[nodiscard]] static Result<StopEvent> make();
  void set() const noexcept;
  /// Readable from set() on.
  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  [[nodiscard]] bool is_set() const noexcept;
  /// True: it was set before `deadline`.
  [[nodiscard]] bool wait_until(TimePoint deadline) const noexcept;

 private:
  explicit StopEvent(UniqueFd fd) noexcept : fd_(std::move(fd)) {}
  UniqueFd fd_;
};

/// Waits until `fd` has one of `events`; -1: for none. False: the time is over, or the stop came first;
/// null: no stop counts.
[[nodiscard]] bool wait_for(int fd, short events, TimePoint deadline, const StopEvent* stop) noexcept;

}  // namespace plchost::modbus
