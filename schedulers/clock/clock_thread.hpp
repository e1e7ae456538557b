#pragma once

#include <functional>
#include <string>

#include "schedulers/clock/clock.hpp"
#include "shm/base/thread.hpp"

namespace plchost {

/// Thread::start for a thread that sleeps by `clock`: tells the clock, lets the thread wake without slack,
/// and gives it a stack for its signals. Set-up.
[[nodiscard]] Result<Thread> start_clock_thread(Clock& clock, const std::string& name,
                                                ThreadPriority priority, std::function<void()> body);

}  // namespace plchost
