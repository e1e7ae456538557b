#include "schedulers/supervision/starvation.hpp"

#include <algorithm>
#include <utility>

namespace plchost {

namespace {

// Nobody waits for what has no real-time priority, or takes only what is left.
bool must_run(const Task& task) noexcept {
  return !task.kind().limits_itself && task.config().iec_priority <= kLowestRealTimeIecPriority;
}

}  // namespace

Starvation::Starvation(const std::vector<std::unique_ptr<Task>>& tasks, const FaultTrap& event_variables,
                       const ProcessorTimes& times)
    : tasks_(tasks),
      event_variables_(event_variables),
      times_(times),
      hunger_(tasks.size()),
      own_threads_(tasks.size() + 1),
      search_(times) {}

void Starvation::begin(Duration guard) noexcept {
  limit_.store(limit_for(guard).count(), std::memory_order_relaxed);
}

TimePoint Starvation::look(TimePoint now, bool running) noexcept {
  const Duration step = limit() / kLooks;
  if (step == Duration::zero()) return kNoDeadline;
  take_reported(now);
  if (search_.begun() && now >= search_.ends()) end_search(now);
  if (now >= next_) {
    next_ = now + step;
    for (std::size_t i = 0; running && i < tasks_.size(); ++i) {
      if (must_run(*tasks_[i])) look_at(i, now);
    }
  }
  return search_.begun() ? std::min(next_, search_.ends()) : next_;
}

void Starvation::look_at(std::size_t index, TimePoint now) noexcept {
  Hunger& hunger = hunger_[index];
  const auto demand = tasks_[index]->demand(now);
  if (!demand || demand != hunger.demand) {
    hunger = {.demand = demand, .looked_at = now};
    return;
  }
  const Duration step = limit() / kLooks;
  const Duration gone = std::min(now - std::exchange(hunger.looked_at, now), step + kStandstill);
  if (!std::exchange(hunger.measured, true)) {  // most are gone at the second look
    hunger.used = used_by(tasks_[index]->trap());
    hunger.by_process = times_.of_process();
    hunger.by_tasks = used_by_tasks();
    return;
  }
  hunger.lasted += gone;
  if (hunger.lasted < limit() || search_.begun()) return;
  constexpr int kNothing = 100;  // less than one part of so many
  const bool got_none = used_by(tasks_[index]->trap()) - hunger.used <= hunger.lasted / kNothing;
  // A cycle may wait for something else. A due task may, too, but then because the thread that releases it
  // gets nothing.
  const bool sleeps = times_.sleeps(tasks_[index]->trap().thread());
  const bool starves = got_none && !(sleeps && hunger.demand->cycle_since);
  const Takers takers = starves ? takers_from(index) : Takers::threads_of_tasks;
  if (takers == Takers::other_threads) {
    searched_for_ = index;
    search_.begin(now);
    return;
  }
  if (takers == Takers::other_programs && !sleeps) by_others_.store(index + 1, std::memory_order_relaxed);
  hunger = {.demand = demand, .looked_at = now};
}

// The other watchdogs judge the time of the threads that run tasks.
Starvation::Takers Starvation::takers_from(std::size_t index) noexcept {
  const Hunger& hunger = hunger_[index];
  const Duration by_process = times_.of_process() - hunger.by_process;
  const Duration by_tasks = used_by_tasks() - hunger.by_tasks;
  if (by_process - by_tasks >= hunger.lasted / 2) return Takers::other_threads;
  return by_process >= hunger.lasted / 2 ? Takers::threads_of_tasks : Takers::other_programs;
}

// The task has its fault as soon as its cause is gone. Then the others are looked for that were below it.
void Starvation::end_search(TimePoint now) noexcept {
  (void)used_by_tasks();  // which threads they are
  const ThreadText who = search_.end(now, own_threads_);
  const auto index = std::exchange(searched_for_, std::nullopt);
  if (!who.view().empty()) {
    if (index) raise(*tasks_[*index], hunger_[*index].lasted, who);
    search_.begin(now);
  }
  if (index) hunger_[*index] = {};
}

// Of a thread above this one.
void Starvation::take_reported(TimePoint now) noexcept {
  const auto taker = ProcessorGuard::take();
  if (!taker) return;
  if (Task* const task = hungriest(now)) raise(*task, taker->lasted, taker->who);
  searched_for_.reset();
  search_.begin(now);
}

void Starvation::raise(Task& task, Duration lasted, const ThreadText& who) noexcept {
  TaskFault& fault = task.fault();
  if (!fault.claim(true)) return;
  fault.record().kind = FaultKind::no_processor;
  fault.record().figure = lasted.count();
  fault.record().limit = limit().count();
  fault.record().text.assign(who.view());
  fault.publish();
}

Task* Starvation::hungriest(TimePoint now) const noexcept {
  const auto waits = [&](const auto& task) { return must_run(*task) && task->demand(now).has_value(); };
  auto found = std::ranges::find_if(tasks_, waits);
  if (found == tasks_.end()) found = tasks_.begin();
  return found == tasks_.end() ? nullptr : found->get();
}

Duration Starvation::used_by(const FaultTrap& trap) const noexcept {
  return trap.thread() == 0 ? Duration::zero() : times_.of_thread(trap.thread());
}

Duration Starvation::used_by_tasks() noexcept {
  Duration used = used_by(event_variables_);
  own_threads_.back() = event_variables_.thread();
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    used += used_by(tasks_[i]->trap());
    own_threads_[i] = tasks_[i]->trap().thread();
  }
  return used;
}

std::optional<std::size_t> Starvation::take_starved_by_others() noexcept {
  const std::size_t found = by_others_.exchange(0, std::memory_order_relaxed);
  if (found == 0) return std::nullopt;
  return found - 1;
}

void TakerSearch::begin(TimePoint now) noexcept {
  std::array<pid_t, kMost> found{};
  count_ = times_.real_time_threads(found);
  for (std::size_t i = 0; i < count_; ++i) {
    threads_[i] = {.id = found[i], .used = times_.of_thread(found[i])};
  }
  began_ = now;
  begun_ = true;
}

ThreadText TakerSearch::end(TimePoint now, std::span<const pid_t> spared) noexcept {
  constexpr int kPart = 10;
  begun_ = false;
  ThreadText busiest;
  Duration most{};
  for (const Thread& thread : std::span(threads_).first(count_)) {
    const Duration used = times_.of_thread(thread.id) - thread.used;
    if (used <= (now - began_) / kPart || std::ranges::find(spared, thread.id) != spared.end()) continue;
    const ThreadText who = times_.demote(thread.id);
    if (who.view().empty() || used <= most) continue;
    busiest = who;
    most = used;
  }
  return busiest;
}

}  // namespace plchost
