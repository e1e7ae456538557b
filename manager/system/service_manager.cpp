#include "manager/system/service_manager.hpp"

#include <chrono>
#include <cinttypes>
#include <cstdint>

#include <systemd/sd-daemon.h>

#include "shm/base/time.hpp"

namespace plchost {

void notify_service_manager(const char* state) noexcept {
  ::sd_notify(0, state);
}

void notify_reloading() noexcept {
  const std::int64_t now_us =
      std::chrono::duration_cast<std::chrono::microseconds>(MonotonicClock::now().time_since_epoch()).count();
  ::sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%" PRIi64, now_us);  // NOLINT: variadic
}

}  // namespace plchost
