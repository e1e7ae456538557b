#include "api/server/heap_trim.hpp"

#include <malloc.h>

namespace plchost {

void give_large_blocks_back() noexcept {
  constexpr int kLarge = 128 * 1024;
  (void)::mallopt(M_MMAP_THRESHOLD, kLarge);
}

void HeapTrim::worked(std::uint64_t clients, TimePoint now) noexcept {
  if (clients == 0) return;
  work_ += clients;
  last_work_ = now;
}

bool HeapTrim::look(TimePoint now) noexcept {
  if (work_ < kWorth || now - last_work_ < kQuiet) return false;
  work_ = 0;
  (void)::malloc_trim(0);
  return true;
}

}  // namespace plchost
