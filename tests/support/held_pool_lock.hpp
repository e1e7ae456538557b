#pragma once

#include <future>
#include <string>
#include <thread>

#include "shm/files/memory_file.hpp"
#include "shm/pool/pool_layout.hpp"

namespace plchost {

/// Keeps the lock of a pool, by a thread of this process that lives on, until it goes.
class HeldPoolLock {
 public:
  explicit HeldPoolLock(const std::string& pool)
      : memory_(MemoryFile::open(pool, sizeof(PoolHeader), MemoryFile::Access::read_write).value()),
        holder_([this] { hold(); }) {
    locked_.get_future().wait();
  }
  HeldPoolLock(const HeldPoolLock&) = delete;
  HeldPoolLock& operator=(const HeldPoolLock&) = delete;
  ~HeldPoolLock() { enough_.set_value(); }

 private:
  void hold() {
    RobustMutex& mutex = reinterpret_cast<PoolHeader*>(memory_.bytes().data())->mutex;
    (void)mutex.lock();
    locked_.set_value();
    enough_.get_future().wait();
    mutex.unlock();
  }

  MemoryFile memory_;
  std::promise<void> locked_;
  std::promise<void> enough_;
  std::jthread holder_;
};

}  // namespace plchost
