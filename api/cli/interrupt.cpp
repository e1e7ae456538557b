#include "api/cli/interrupt.hpp"

#include <atomic>
#include <csignal>

namespace plchost {

namespace {

std::atomic<bool>& flag() noexcept {
  static std::atomic<bool> has_come{false};
  return has_come;
}

}  // namespace

void catch_interrupts() {
  struct sigaction action{};
  action.sa_handler = [](int /*signal*/) { flag().store(true); };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() noexcept {
  return flag().load();
}

}  // namespace plchost
