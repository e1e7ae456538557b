#include "shm/pool/process_pools.hpp"

#include <algorithm>

#include <pthread.h>

#include "shm/pool/pool_mutex.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

ProcessPools& ProcessPools::of_this_process() {
  static ProcessPools& pools = *new ProcessPools();
  return pools;
}

ProcessPools::ProcessPools() {
  static ProcessPools* self = nullptr;
  self = this;
  (void)::pthread_key_create(&thread_end_, [](void* held) {
    if (*static_cast<std::uint32_t*>(held) > 0) self->abandon_mutexes();
  });
  (void)::pthread_atfork([] { self->mutex_.lock(); }, [] { self->mutex_.unlock(); },
                         [] {
                           for (const auto& file : self->files_) file->number_ = 0;
                           PoolMutex::forget_held();
                           self->mutex_.unlock();
                         });
}

std::shared_ptr<ClientLocks> ProcessPools::find(std::uint64_t device, std::uint64_t file) const {
  const auto found = std::ranges::find_if(
      files_, [&](const auto& one) { return one->device_ == device && one->file_ == file; });
  return found == files_.end() ? nullptr : *found;
}

void ProcessPools::keep(std::shared_ptr<ClientLocks> locks) {
  std::erase_if(files_, [](const auto& one) { return one.use_count() == 1 && one->is_nameless(); });
  files_.push_back(std::move(locks));
}

void ProcessPools::add(const PoolView& pool, ClientLocks& locks) {
  const auto held = lock();
  pools_.push_back({.view = pool, .locks = &locks});
}

void ProcessPools::remove(const PoolView& pool) {
  const auto held = lock();
  std::erase_if(pools_, [&](const Used& used) { return &used.view.header() == &pool.header(); });
}

void ProcessPools::abandon_mutexes() noexcept {
  const auto held = lock();
  for (const Used& pool : pools_) {
    const ClientThread self{.client = pool.locks->number_, .thread = this_thread().id};
    if (self.client == 0) continue;
    PoolMutex::across(pool.view.header().mutex).abandon(self);
    for (ObjectEntry& entry : pool.view.used_entries()) PoolMutex::across(entry.mutex).abandon(self);
  }
}

}  // namespace plchost
