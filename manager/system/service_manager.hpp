#pragma once

namespace plchost {

/// Tells the service manager that started us, if there is one ("READY=1", "STOPPING=1").
void notify_service_manager(const char* state) noexcept;

/// The same: the configuration is being read again, from now on until "READY=1".
void notify_reloading() noexcept;

}  // namespace plchost
