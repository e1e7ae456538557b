#pragma once

#include <cstdint>
#include <string_view>

#include "shm/base/counted_event.hpp"

namespace plchost {

class PoolView;
struct ObjectEntry;

/// The effect of a post.
enum class PostResult : std::uint8_t {
  posted,          ///< counted, and tasks took posts at that moment: each of them runs for it, or, if it is
                   ///< stopped before, counts it as lost
  no_task,         ///< counted, but no task took posts at that moment, and none runs for it: a soft result
  not_registered,  ///< nothing was counted: the event is not (or no longer) registered
};

/// A handle on one external event of the pool, for programs that post to it and bind tasks to it. These
/// registrations and bindings hold the event, and not the handle. Cheap to copy; valid while the ObjectPool
/// that gave it exists.
class PoolEvent {
 public:
  PoolEvent() noexcept = default;

  /// Any context, real-time included: one atomic add, and one wake if someone waits.
  PostResult post() const noexcept;

  /// Whether it may be posted to. A task may be bound to an event that is not registered yet.
  [[nodiscard]] bool registered() const noexcept;
  /// False, and nothing is done, if the handle is not valid (any more).
  bool set_registered(bool registered) const noexcept;

  /// How many tasks wait for it: kept by their instance, so that a poster can be told.
  [[nodiscard]] std::uint32_t bound_tasks() const noexcept;
  /// False, and nothing is done, if the handle is not valid (any more). From 0 to more: the tasks run for
  /// the posts after it; back to 0: only for those before it.
  bool set_bound_tasks(std::uint32_t count) const noexcept;
  /// For so many tasks that take no posts yet: the event keeps its place, and posters are told that there is
  /// no task. False, and nothing is done, if the handle is not valid (any more).
  bool hold_for_tasks(std::uint32_t count) const noexcept;

  /// The counter itself, for the task that waits on it. Only of a valid handle.
  [[nodiscard]] CountedEvent& counted() const noexcept;

  /// False if the handle is empty, or the object behind it was removed and its place given to another.
  [[nodiscard]] bool valid() const noexcept;

 private:
  friend class ObjectPool;
  friend class SharedEvent;
  friend void withdraw_events(const PoolView& view, std::string_view owner) noexcept;
  explicit PoolEvent(ObjectEntry& entry) noexcept;
  bool change_binding(std::uint64_t clear, std::uint64_t set) const noexcept;

  ObjectEntry* entry_ = nullptr;
  std::uint32_t generation_ = 0;
};

/// For ObjectPool::withdraw_events().
void withdraw_events(const PoolView& view, std::string_view owner) noexcept;

}  // namespace plchost
