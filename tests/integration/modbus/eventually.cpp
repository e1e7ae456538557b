#include <chrono>
#include <functional>
#include <thread>

#include "shm/base/time.hpp"
#include "tests/integration/modbus/modbus_program.hpp"

namespace plchost::testing {

bool eventually(const std::function<bool()>& condition) {
  using namespace std::chrono_literals;
  const auto give_up = MonotonicClock::now() + 40s;
  while (MonotonicClock::now() < give_up) {
    if (condition()) return true;
    std::this_thread::sleep_for(5ms);
  }
  return condition();
}

}  // namespace plchost::testing
