#include "shm/files/guarded_mapping.hpp"

#include <utility>

#include <sys/mman.h>

namespace plchost {

GuardedMapping::GuardedMapping(GuardedMapping&& other) noexcept
    : bytes_(std::exchange(other.bytes_, {})), guard_(std::move(other.guard_)) {}

GuardedMapping& GuardedMapping::operator=(GuardedMapping&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  std::swap(guard_, other.guard_);
  return *this;
}

// The guard first: a mend of what is no longer mapped would map it again.
GuardedMapping::~GuardedMapping() {
  guard_ = MemoryGuard();
  if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size());
}

}  // namespace plchost
