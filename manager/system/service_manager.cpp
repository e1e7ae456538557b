#include "manager/system/service_manager.hpp"

#include <systemd/sd-daemon.h>

namespace plchost {

void notify_service_manager(const char* state) noexcept {
  ::sd_notify(0, state);
}

}  // namespace plchost
