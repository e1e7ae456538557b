#include "tests/models/checker/client_roll.hpp"

#include "tests/models/checker/explorer.hpp"

namespace plchost::models {

// A thread that sees the end of another one knows all that it has done: the kernel has ended it.
bool KilledRoll::lives(std::uint32_t client) const noexcept {
  const Arena::Use off(false);
  Explorer& scene = *explorer();
  const ThreadNumber number = client - client_of(0).client;
  scene.step(Explorer::kAnywhere, true);
  const bool killed = scene.killed(number);
  scene.done("looks at client", 0, number, killed ? 1 : 0);
  if (killed) scene.memory().learn(scene.self(), number);
  return !killed;
}

}  // namespace plchost::models
