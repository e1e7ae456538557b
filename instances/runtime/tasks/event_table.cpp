#include "instances/runtime/tasks/event_table.hpp"

#include <span>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/tasks/handle.hpp"
#include "schedulers/tasks/task.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/flight_page.hpp"

namespace plchost {

namespace {

// Which task has posted: it tells so itself. Threads of components tell nothing.
void tell_post(std::uint32_t mark, const CountedEvent& event) noexcept {
  FlightRing* const flight = Task::flight_here();
  if (flight == nullptr) return;
  flight->put(MonotonicClock::now(), FlightKind::posted, posted_figure(mark, event.count()));
}

}  // namespace

// A pool that cannot be locked is met here, where the start may be repeated, and not by the application.
Result<void> EventTable::clear_left_behind() {
  if (pool_ == nullptr) return {};
  PLCHOST_TRY(pool_->list());
  pool_->withdraw_events(instance_);
  return {};
}

void EventTable::withdraw_own() noexcept {
  for (std::size_t i = 0; i < count_.load(std::memory_order_relaxed); ++i) {
    const PoolEvent* const event = slots_[i]->event.load(std::memory_order_relaxed);
    if (!slots_[i]->own || event == nullptr) continue;
    (void)event->set_bound_tasks(0);
    (void)event->set_registered(false);
  }
}

EventTable::Slot* EventTable::find(RTS_HANDLE handle) const noexcept {
  const std::size_t index = index_of(handle);
  return index < count_.load(std::memory_order_acquire) ? slots_[index].get() : nullptr;
}

// Null, too, if the slot was given back.
EventTable::Slot* EventTable::find_open(RTS_HANDLE handle) const noexcept {
  Slot* const slot = find(handle);
  return slot == nullptr || slot->free ? nullptr : slot;
}

Result<void> EventTable::attach(Slot& slot) {
  if (pool_ == nullptr) return room_ ? room_->take(slot.object) : Result<void>();
  PLCHOST_TRY_ASSIGN(const auto event, pool_->create_event(slot.object));
  slot.events.push_back(std::make_unique<PoolEvent>(event));
  slot.mark.store(event_mark(slot.object), std::memory_order_relaxed);
  slot.event.store(slot.events.back().get(), std::memory_order_release);  // pairs with the acquire in post()
  return {};
}

Result<RTS_HANDLE> EventTable::open(std::string_view name) {
  const std::size_t slash = name.find('/');
  const std::string_view owner = slash == std::string_view::npos ? instance_ : name.substr(0, slash);
  const std::string_view event = slash == std::string_view::npos ? name : name.substr(slash + 1);
  PLCHOST_TRY(check_name("instance name", owner, kMaxInstanceName));
  PLCHOST_TRY(check_name("event name", event, kMaxEventName));

  std::string object = event_object_name(owner, event);
  const std::size_t place = place_for(object);
  const std::size_t count = count_.load(std::memory_order_relaxed);
  if (place == kMaxEvents) {
    return failure(ErrorCode::full,
                   fmt::format("external event '{}': an instance deals with at most {}", name, kMaxEvents));
  }
  if (place < count && !slots_[place]->free) {
    slots_[place]->of_version = slots_[place]->of_version && for_version_;
    return to_handle(place);
  }
  auto fresh = place == count ? std::make_unique<Slot>() : nullptr;
  Slot& slot = fresh ? *fresh : *slots_[place];
  PLCHOST_TRY(reopen(slot, std::move(object)));
  slot.own = owner == instance_;
  slot.name = event;
  slot.of_version = for_version_;
  if (fresh) {
    slots_[place] = std::move(fresh);
    count_.store(place + 1, std::memory_order_release);  // pairs with the acquire in find()
  }
  return to_handle(place);
}

// Where the event is, or is to be: best in a free slot that it has had before. Another one's is taken only
// when there is no fresh one, as somebody may have kept its handle. kMaxEvents: nowhere.
std::size_t EventTable::place_for(std::string_view object) const noexcept {
  const std::size_t count = count_.load(std::memory_order_relaxed);
  std::size_t place = count;
  for (std::size_t i = 0; i < count; ++i) {
    if (slots_[i]->object == object) return i;
    if (slots_[i]->free && count == kMaxEvents && place == count) place = i;
  }
  return place;
}

// A slot that has no event, or has given it back.
Result<void> EventTable::reopen(Slot& slot, std::string object) {
  const PoolEvent* const last = slot.events.empty() ? nullptr : slot.events.back().get();
  if (slot.object == object && last != nullptr && last->valid()) {
    slot.event.store(last, std::memory_order_release);
  } else {
    slot.object = std::move(object);
    if (auto attached = attach(slot); !attached) {
      slot.object.clear();
      return attached;
    }
  }
  slot.free = false;
  return {};
}

void EventTable::keep_opened() noexcept {
  for (std::size_t i = 0; i < count_.load(std::memory_order_relaxed); ++i) slots_[i]->of_version = false;
}

void EventTable::give_back_opened() noexcept {
  for (std::size_t i = 0; i < count_.load(std::memory_order_relaxed); ++i) {
    Slot& slot = *slots_[i];
    if (!std::exchange(slot.of_version, false) || slot.registered() || slot.tasks > 0) continue;
    slot.free = true;
    slot.event.store(nullptr, std::memory_order_release);
  }
}

Result<EventTable::Slot*> EventTable::open_own(std::string_view event) {
  PLCHOST_TRY_ASSIGN(const auto handle, open(event));
  Slot* const slot = find(handle);
  if (slot->own) return slot;
  return failure(ErrorCode::invalid_argument,
                 fmt::format("external event '{}' belongs to another instance than '{}'", event, instance_));
}

// It is registered by that party only if the pool tells of it: the next registration would else be told that
// it is there already.
Result<void> EventTable::register_by(Slot& slot, bool Slot::* party) {
  const bool before = std::exchange(slot.*party, true);
  auto published = publish_registered(slot);
  if (!published) slot.*party = before;
  return published;
}

Result<void> EventTable::publish_registered(Slot& slot) {
  if (pool_ == nullptr) return {};
  if (!slot.event.load(std::memory_order_relaxed)->set_registered(true)) {
    // It lost its place in the pool while nobody used it; a task that was bound to it notices in
    // hold_bound().
    PLCHOST_TRY(attach(slot));
    if (!slot.event.load(std::memory_order_relaxed)->set_registered(true)) {
      return failure(ErrorCode::busy, fmt::format("external event '{}' lost its place again", slot.name));
    }
  }
  show_use(slot);
  return {};
}

// Parties have ended their registrations. An event that lost its place in the pool is registered no more.
void EventTable::withdraw_registered(Slot& slot) {
  if (pool_ == nullptr) return;
  (void)slot.event.load(std::memory_order_relaxed)->set_registered(slot.registered());
  show_use(slot);
}

// So that others see who uses it, and so that it keeps its place in the pool while the tasks are stopped. It
// works without, so no right and no room for a reference are no error.
void EventTable::show_use(Slot& slot) {
  const bool used = slot.registered() || slot.tasks > 0;
  if (!used) {
    slot.reference.close();
  } else if (pool_ != nullptr && !slot.reference.valid()) {
    if (auto reference = pool_->open_shared_event(slot.object)) slot.reference = *std::move(reference);
  }
}

Result<void> EventTable::register_by_application(RTS_HANDLE handle) {
  Slot* const slot = find_open(handle);
  if (slot == nullptr) return failure(ErrorCode::invalid_argument, "not the handle of an external event");
  if (!slot->own) return {};  // its registration is its own instance's
  if (slot->by_application) {
    return failure(ErrorCode::already_exists, fmt::format("external event '{}' is registered", slot->name));
  }
  return register_by(*slot, &Slot::by_application);
}

bool EventTable::is_own(RTS_HANDLE handle) const noexcept {
  const Slot* const slot = find_open(handle);
  return slot != nullptr && slot->own;
}

bool EventTable::is_by_application(RTS_HANDLE handle) const noexcept {
  const Slot* const slot = find_open(handle);
  return slot != nullptr && slot->by_application;
}

Result<void> EventTable::unregister_by_application(RTS_HANDLE handle) {
  Slot* const slot = find_open(handle);
  if (slot == nullptr) return failure(ErrorCode::invalid_argument, "not the handle of an external event");
  if (!slot->own) return {};
  if (!slot->by_application) {
    return failure(ErrorCode::not_found, fmt::format("external event '{}' is not registered", slot->name));
  }
  slot->by_application = false;
  withdraw_registered(*slot);
  return {};
}

Result<void> EventTable::register_by_device(std::string_view event) {
  PLCHOST_TRY_ASSIGN(const auto slot, open_own(event));
  return register_by(*slot, &Slot::by_device);
}

Result<void> EventTable::register_by_operator(std::string_view event) {
  PLCHOST_TRY_ASSIGN(const auto slot, open_own(event));
  if (slot->registered()) {
    return failure(ErrorCode::already_exists,
                   fmt::format("external event '{}' is registered already", event));
  }
  return register_by(*slot, &Slot::by_operator);
}

Result<void> EventTable::unregister_by_operator(std::string_view event) {
  PLCHOST_TRY_ASSIGN(const auto slot, open_own(event));
  if (slot->by_device) {
    return failure(
        ErrorCode::refused,
        fmt::format("external event '{}' is one of the device description: it stays registered", event));
  }
  if (!slot->registered()) {
    std::vector<std::string_view> known;
    for (std::size_t i = 0; i < count_.load(std::memory_order_relaxed); ++i) {
      const Slot& other = *slots_[i];
      if (other.registered()) known.push_back(other.name);
    }
    return failure(
        ErrorCode::not_found,
        fmt::format("external event '{}' is not registered; registered are: {}", event, join_names(known)));
  }
  slot->by_application = slot->by_operator = false;
  withdraw_registered(*slot);
  return {};
}

std::vector<std::string> EventTable::registered_by_operator() const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count_.load(std::memory_order_relaxed); ++i) {
    if (slots_[i]->by_operator) names.push_back(slots_[i]->name);
  }
  return names;
}

Result<CountedEvent*> EventTable::bind_task(std::string_view event) {
  PLCHOST_TRY_ASSIGN(const auto slot, open_own(event));
  if (slot->bound == nullptr) slot->bound = slot->event.load(std::memory_order_relaxed);
  ++slot->tasks;
  show_use(*slot);
  return slot->bound == nullptr ? &slot->own_counter : &slot->bound->counted();
}

Result<void> EventTable::hold_bound() {
  for (std::size_t i = 0; i < count_.load(std::memory_order_relaxed); ++i) {
    const Slot& slot = *slots_[i];
    if (slot.tasks == 0 || slot.bound == nullptr) continue;
    if (slot.bound->hold_for_tasks(slot.tasks)) continue;
    publish_bound(false);
    return failure(
        ErrorCode::wrong_state,
        fmt::format("external event '{}' lost its place in the object pool, which was full or damaged, "
                    "while the application was stopped: reset the instance",
                    slot.name));
  }
  return {};
}

void EventTable::publish_bound(bool running) {
  for (std::size_t i = 0; i < count_.load(std::memory_order_relaxed); ++i) {
    Slot& slot = *slots_[i];
    if (slot.tasks == 0 || slot.bound == nullptr) continue;
    slot.taking = running ? slot.tasks : 0;
    const bool told = slot.bound->set_bound_tasks(slot.taking);
    if (told || !running) continue;
    spdlog::error(
        "external event '{}' lost its place in the object pool, which was damaged: its task does not "
        "run for posts. Reset the instance",
        slot.name);
  }
}

void EventTable::withdraw_task(std::string_view event) {
  const auto slot = open_own(event);
  if (!slot || (*slot)->taking == 0) return;
  (void)(*slot)->bound->set_bound_tasks(--(*slot)->taking);
}

void EventTable::refresh() {
  for (std::size_t i = 0; i < count_.load(std::memory_order_relaxed); ++i) {
    Slot& slot = *slots_[i];
    const PoolEvent* const event = slot.event.load(std::memory_order_relaxed);
    // An own event is left to the paths above, which know what it is needed for.
    if (!slot.own && event != nullptr && !event->valid()) (void)attach(slot);
  }
}

RTS_RESULT EventTable::post(RTS_HANDLE handle) const noexcept {
  const Slot* const slot = find(handle);
  if (slot == nullptr) return ERR_PARAMETER;
  const PoolEvent* const event = slot->event.load(std::memory_order_acquire);
  if (event == nullptr) return pool_ == nullptr ? ERR_NO_TASK : ERR_PARAMETER;  // it was given back
  switch (event->post()) {
    case PostResult::posted:
      tell_post(slot->mark.load(std::memory_order_relaxed), event->counted());
      return ERR_OK;
    case PostResult::no_task:
      return ERR_NO_TASK;
    case PostResult::not_registered:
      return ERR_NO_OBJECT;
  }
  return ERR_FAILED;
}

RTS_RESULT EventTable::set(RTS_HANDLE handle) const noexcept {
  const Slot* const slot = find(handle);
  if (slot == nullptr) return ERR_PARAMETER;
  const PoolEvent* const event = slot->event.load(std::memory_order_acquire);
  if (event == nullptr) return pool_ == nullptr ? ERR_NO_TASK : ERR_PARAMETER;
  // Only while a task is bound is its counter surely this event's own.
  if (event->bound_tasks() == 0) return ERR_NO_TASK;
  if (!event->counted().post()) return ERR_NO_TASK;
  tell_post(slot->mark.load(std::memory_order_relaxed), event->counted());
  return ERR_OK;
}

}  // namespace plchost
