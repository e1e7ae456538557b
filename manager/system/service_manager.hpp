#pragma once

namespace plchost {

/// Tells the service manager that started us, if there is one ("READY=1", "STOPPING=1").
void notify_service_manager(const char* state) noexcept;

}  // namespace plchost
