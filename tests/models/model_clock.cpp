#include "tests/models/model_clock.hpp"

namespace plchost {

// In the place of the real clock's.
Duration Clock::thread_time() const noexcept {
  return Duration::zero();
}

}  // namespace plchost
