#pragma once

#include "shm/base/time.hpp"

namespace plchost {

/// For commands that go on until Ctrl-C: from now on SIGINT and SIGTERM do not end the process, so that the
/// command ends by itself.
void catch_interrupts();
/// One of them has come.
[[nodiscard]] bool interrupted() noexcept;

/// As long as such a command may wait without a look, for an end that comes at once.
inline constexpr Duration kInterruptLook = std::chrono::milliseconds(50);
/// Sleeps until then, or until one of them comes.
void sleep_until_interrupted(TimePoint end);

}  // namespace plchost
