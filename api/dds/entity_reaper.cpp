#include "api/dds/entity_reaper.hpp"

#include <iterator>
#include <utility>

#include "api/dds/instances.hpp"

namespace plchost::dds {

Result<std::unique_ptr<EntityReaper>> EntityReaper::create() {
  std::unique_ptr<EntityReaper> reaper(new EntityReaper());
  PLCHOST_TRY_ASSIGN(reaper->thread_, Thread::start("dds-reaper", {}, [&self = *reaper] { self.run(); }));
  return reaper;
}

EntityReaper::~EntityReaper() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void EntityReaper::take(std::vector<Entity> entities) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() < kMost) {
      waiting_.insert(waiting_.end(), std::make_move_iterator(entities.begin()),
                      std::make_move_iterator(entities.end()));
      entities.clear();
    }
  }
  changed_.notify_one();
  for (Entity& entity : entities) delete_entity(std::move(entity));
}

void EntityReaper::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    std::vector<Entity> entities = std::exchange(waiting_, {});
    lock.unlock();
    for (Entity& entity : entities) delete_entity(std::move(entity));
    lock.lock();
  }
}

}  // namespace plchost::dds
