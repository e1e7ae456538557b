#include "shm/pool/pool_event.hpp"

#include "shm/pool/pool_layout.hpp"
#include "shm/pool/pool_table.hpp"
#include "shm/pool/pool_view.hpp"

namespace plchost {

PoolEvent::PoolEvent(ObjectEntry& entry) noexcept
    : entry_(&entry), generation_(Binding::generation(entry.binding.load(std::memory_order_acquire))) {}

PostResult PoolEvent::post() const noexcept {
  if (entry_ == nullptr) return PostResult::not_registered;
  // Acquire pairs with the release of the thread that registered it, and of the one that gave the entry to
  // another object.
  const std::uint64_t binding = entry_->binding.load(std::memory_order_acquire);
  if (Binding::generation(binding) != generation_ || !Binding::registered(binding)) {
    return PostResult::not_registered;
  }
  return entry_->event.post() ? PostResult::posted : PostResult::no_task;
}

bool PoolEvent::valid() const noexcept {
  return entry_ != nullptr &&
         Binding::generation(entry_->binding.load(std::memory_order_acquire)) == generation_;
}

bool PoolEvent::registered() const noexcept {
  return valid() && Binding::registered(entry_->binding.load(std::memory_order_acquire));
}

std::uint32_t PoolEvent::bound_tasks() const noexcept {
  return valid() ? Binding::bound(entry_->binding.load(std::memory_order_acquire)) : 0;
}

bool PoolEvent::change_binding(std::uint64_t clear, std::uint64_t set) const noexcept {
  if (entry_ == nullptr) return false;
  std::uint64_t before = entry_->binding.load(std::memory_order_acquire);
  do {
    if (Binding::generation(before) != generation_) return false;
  } while (!entry_->binding.compare_exchange_weak(before, (before & ~clear) | set, std::memory_order_acq_rel,
                                                  std::memory_order_acquire));
  return true;
}

bool PoolEvent::set_registered(bool registered) const noexcept {
  return change_binding(Binding::kRegistered, registered ? Binding::kRegistered : 0);
}

bool PoolEvent::set_bound_tasks(std::uint32_t count) const noexcept {
  if (!hold_for_tasks(count)) return false;
  entry_->event.set_taken(count > 0);
  return true;
}

bool PoolEvent::hold_for_tasks(std::uint32_t count) const noexcept {
  return change_binding(Binding::kBoundMask, count & Binding::kBoundMask);
}

// The handle is made before the name is read: if the place is given to another object meanwhile, it is not
// valid any more and changes nothing.
void withdraw_events(const PoolView& view, std::string_view owner) noexcept {
  for (ObjectEntry& entry : view.used_entries()) {
    const PoolEvent event(entry);
    if (!PoolTable::is_valid(entry)) continue;
    if (entry.type.load(kRelaxed) != static_cast<std::uint32_t>(ObjectType::event)) continue;
    const std::string_view name = entry.name.view();
    if (!name.starts_with(owner) || name.substr(owner.size(), 1) != "/") continue;
    (void)event.set_bound_tasks(0);
    (void)event.set_registered(false);
  }
}

CountedEvent& PoolEvent::counted() const noexcept {
  return entry_->event;
}

}  // namespace plchost
