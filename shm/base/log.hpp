#pragma once

#include <string>

#include <spdlog/spdlog.h>

namespace plchost {

/// Makes standard error the log of this process: "2026-01-31 12:00:00.000 warning plchostd: text". Set-up.
/// Never called from a real-time thread; `level` is one of trace, debug, info, warning, error.
void start_log(const std::string& program, const std::string& level = "info");

}  // namespace plchost
