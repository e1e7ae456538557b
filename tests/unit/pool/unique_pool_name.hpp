#pragma once

#include <atomic>
#include <string>

#include "shm/files/pool_files.hpp"
#include "shm/pool/object_pool.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {

/// A name for shared memory that no other test uses; memories under it are removed at the end.
class UniquePoolName {
 public:
  UniquePoolName() = default;
  ~UniquePoolName() {
    ObjectPool::remove(name_);
    remove_pool_memories(name_);
  }
  UniquePoolName(const UniquePoolName&) = delete;
  UniquePoolName& operator=(const UniquePoolName&) = delete;
  [[nodiscard]] const std::string& get() const { return name_; }

 private:
  std::string name_ = own_name("pool");
};

}  // namespace plchost
