#pragma once

#include <atomic>
#include <string>

#include <unistd.h>

#include "shm/pool/memory_file.hpp"

namespace plchost {

/// A name for shared memory that no other test uses; what was made under it is removed at the end.
class UniquePoolName {
 public:
  UniquePoolName() {
    static std::atomic<int> counter{0};
    name_ = "plchost-test-" + std::to_string(::getpid()) + "-" + std::to_string(counter++);
  }
  ~UniquePoolName() {
    MemoryFile::remove(name_);
    remove_pool_memories(name_);
  }
  UniquePoolName(const UniquePoolName&) = delete;
  UniquePoolName& operator=(const UniquePoolName&) = delete;
  [[nodiscard]] const std::string& get() const { return name_; }

 private:
  std::string name_;
};

}  // namespace plchost
