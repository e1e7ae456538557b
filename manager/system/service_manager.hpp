#pragma once

#include <string>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Tells the service manager that started us, if there is one ("READY=1", "STOPPING=1"). Never waits: the
/// part that it does not take now is for notify_of_the_rest(). All of these: one thread.
void notify_service_manager(const std::string& state);
void notify_of_the_rest();

/// The same: the configuration is being read again, from now on until "READY=1".
void notify_reloading();

/// Whether systemd ends this process to start it again at once: `systemctl restart`, or a new version of the
/// package. Asked over D-Bus, for 2 s at most. false: it ends for good, or systemd has not started it.
/// unavailable, timed_out: systemd does not answer.
[[nodiscard]] Result<bool> is_being_restarted();

/// Shows the service manager that a loop goes round, as often as the unit's WatchdogSec= asks for. A service
/// manager that hears nothing for that time ends the process. Without WatchdogSec= it does nothing.
class ServiceWatchdog {
 public:
  ServiceWatchdog() noexcept;
  /// From the loop itself: a thread beside it would hide that it hangs.
  void feed(TimePoint now) noexcept;

 private:
  Duration every_{};  // zero: nobody asks
  TimePoint next_;
};

}  // namespace plchost
