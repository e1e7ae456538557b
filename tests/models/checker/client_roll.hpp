#pragma once

#include "shm/threads/client_mutex.hpp"
#include "tests/models/checker/model.hpp"

namespace plchost::models {

/// The kernel's answer to whether a client lives: in a scene each thread is a process of its own. Its lock is
/// let go of when it was killed.
class KilledRoll final : public ClientRoll {
 public:
  [[nodiscard]] static ClientThread client_of(ThreadNumber thread) noexcept {
    return {.client = 100 + thread, .thread = 7};
  }
  [[nodiscard]] bool lives(std::uint32_t client) const noexcept override;
};

}  // namespace plchost::models
