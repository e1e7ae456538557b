#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "instances/plc_app.h"
#include "shm/base/result.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/pool/pool_room.hpp"

namespace plchost {

/// The external events that this instance deals with, and the handles that applications have on them. A name
/// keeps its slot for the life of the process, unless only a version that was refused has opened it. Slots
/// are never freed, so posting takes no lock. All but post() and set(): control thread only.
class EventTable {
 public:
  static constexpr std::size_t kMaxEvents = 4096;

  /// Without a pool (null) it only collects names: for checking an application that shall touch nothing.
  EventTable(std::string instance, ObjectPool* pool) : instance_(std::move(instance)), pool_(pool) {}

  /// Without a pool: from now on each event is refused that would find no place in `room`. For a trial.
  void look_for_room(PoolRoom room) { room_ = std::move(room); }
  /// That room, for what else the start makes; null: nobody looks for it.
  [[nodiscard]] PoolRoom* room() noexcept { return room_ ? &*room_ : nullptr; }

  /// Takes back the registrations and bound tasks that a process of this instance's name has left. On failure
  /// some may stay, and posters are told that tasks run their posts. timed_out: the pool is locked.
  [[nodiscard]] Result<void> clear_left_behind();
  /// Takes back the registrations and bound tasks of this process. Needs no lock of the pool.
  void withdraw_own() noexcept;

  /// The handle of "event" (own) or "instance/event". invalid_argument; full.
  [[nodiscard]] Result<RTS_HANDLE> open(std::string_view name);

  /// True: names are opened by a version beside the application that runs, from now on. They stay after
  /// keep_opened(). give_back_opened() frees the slots of names that nobody else has opened; handles of those
  /// are none any more.
  void open_for_version(bool on) noexcept { for_version_ = on; }
  void keep_opened() noexcept;
  void give_back_opened() noexcept;

  /// A valid handle of an event of this instance.
  [[nodiscard]] bool is_own(RTS_HANDLE handle) const noexcept;
  /// Registration by the application or a component. already_exists: by one of them before.
  [[nodiscard]] Result<void> register_by_application(RTS_HANDLE handle);
  [[nodiscard]] Result<void> unregister_by_application(RTS_HANDLE handle);
  /// One of them has registered it.
  [[nodiscard]] bool is_by_application(RTS_HANDLE handle) const noexcept;
  /// Registration by the device description, of an own event: for the life of the process.
  [[nodiscard]] Result<void> register_by_device(std::string_view event);
  /// Registration by the operator, of an own event. already_exists: by anyone before.
  [[nodiscard]] Result<void> register_by_operator(std::string_view event);
  /// Ends any registration of an own event. not_found: it has none. refused: the device description has it.
  [[nodiscard]] Result<void> unregister_by_operator(std::string_view event);
  /// The own events that the operator has registered.
  [[nodiscard]] std::vector<std::string> registered_by_operator() const;

  /// The counter that a task bound to the own event waits on; counts the task. invalid_argument: not an own
  /// event.
  [[nodiscard]] Result<CountedEvent*> bind_task(std::string_view event);
  /// Before a start: all counters that tasks are bound to are still theirs, and stay it until
  /// publish_bound(). An event that is neither registered nor bound may lose its place (see ObjectPool).
  /// Posters notice nothing. wrong_state: one is lost, and none is held.
  [[nodiscard]] Result<void> hold_bound();
  /// Tells posters whether the tasks run: bound, or not.
  void publish_bound(bool running);
  /// Tells posters that one of the tasks that are bound to the own event takes no more posts, the others do.
  void withdraw_task(std::string_view event);
  /// Gets events of others that lost their place in the pool back. Called every 100 ms.
  void refresh();

  /// Real-time: see SchedPostExternalEvent and CAL_SysEventSet.
  [[nodiscard]] RTS_RESULT post(RTS_HANDLE handle) const noexcept;
  [[nodiscard]] RTS_RESULT set(RTS_HANDLE handle) const noexcept;

 private:
  struct Slot {
    std::string name;    // as the application calls it; own events without the instance
    std::string object;  // in the pool
    bool own = false;
    bool of_version = false;  // opened by a version beside the application that runs, and by nobody else
    bool free = false;        // given back; `object` is its last one, unless that is empty
    bool by_application = false;
    bool by_operator = false;
    bool by_device = false;
    CountedEvent own_counter;                        // without a pool
    std::uint32_t tasks = 0;                         // bound to it
    std::uint32_t taking = 0;                        // of these, as posters are told: will run what is posted
    const PoolEvent* bound = nullptr;                // the events that they wait on, until the process ends
    std::atomic<std::uint32_t> mark{0};              // of `object`, for the flight recorder
    std::atomic<const PoolEvent*> event{nullptr};    // one of events; null without a pool
    std::vector<std::unique_ptr<PoolEvent>> events;  // old ones stay: a poster may be looking at one
    SharedEvent reference;                           // while it is registered or tasks are bound to it

    [[nodiscard]] bool registered() const noexcept { return by_application || by_operator || by_device; }
  };

  [[nodiscard]] Slot* find(RTS_HANDLE handle) const noexcept;
  [[nodiscard]] Slot* find_open(RTS_HANDLE handle) const noexcept;
  [[nodiscard]] std::size_t place_for(std::string_view object) const noexcept;
  [[nodiscard]] Result<void> reopen(Slot& slot, std::string object);
  [[nodiscard]] Result<Slot*> open_own(std::string_view event);
  [[nodiscard]] Result<void> attach(Slot& slot);
  [[nodiscard]] Result<void> publish_registered(Slot& slot);
  [[nodiscard]] Result<void> register_by(Slot& slot, bool Slot::* party);
  void withdraw_registered(Slot& slot);
  void show_use(Slot& slot);

  std::string instance_;
  ObjectPool* pool_;
  std::optional<PoolRoom> room_;
  bool for_version_ = false;
  std::array<std::unique_ptr<Slot>, kMaxEvents> slots_;
  std::atomic<std::size_t> count_{0};  // written by the control thread; slots below it are complete
};

}  // namespace plchost
