#include "schedulers/supervision/supervision.hpp"

#include <algorithm>
#include <utility>

#include "schedulers/clock/clock.hpp"

namespace plchost {

namespace {

// Where the clock ends before, never.
TimePoint later(TimePoint from, std::int64_t times, Duration interval) noexcept {
  Duration::rep distance = 0;
  Duration::rep sum = 0;
  const bool ends_before = __builtin_mul_overflow(times, interval.count(), &distance) ||
                           __builtin_add_overflow(from.time_since_epoch().count(), distance, &sum);
  return ends_before ? kNoDeadline : TimePoint(Duration(sum));
}

TimePoint at(const std::atomic<Duration::rep>& stamp) noexcept {
  return TimePoint(Duration(stamp.load(std::memory_order_relaxed)));
}

// They take what is left and limit themselves.
bool is_freewheeling(const TaskConfig& task) {
  return find_task_kind(task.kind)->limits_itself;
}

// Nobody waits for what has no real-time priority.
bool is_modest(const TaskConfig& task) {
  return is_freewheeling(task) || task.iec_priority > kLowestRealTimeIecPriority;
}

std::vector<bool> which(const std::vector<std::unique_ptr<Task>>& tasks, bool (*are)(const TaskConfig&)) {
  std::vector<bool> found;
  for (const auto& task : tasks) found.push_back(are(task->config()));
  return found;
}

}  // namespace

Supervision::Supervision(Clock& clock, const std::vector<std::unique_ptr<Task>>& tasks,
                         FaultTrap& event_variables, const ProcessorTimes& times)
    : clock_(clock),
      times_(times),
      watched_(tasks.size() + 1),
      starvation_(tasks, event_variables, times),
      load_(which(tasks, is_freewheeling)),
      overload_(which(tasks, is_modest)),
      task_times_(tasks.size()) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    watched_[i].trap = &tasks[i]->trap();
    watched_[i].task = tasks[i].get();
  }
  watched_.back().trap = &event_variables;
}

Supervision::~Supervision() {
  ending_.store(true);
  change(Mode::off);
  if (thread_.joinable()) ProcessorGuard::watch(Duration::zero());
}

Result<void> Supervision::start_thread(ThreadPriority priority) {
  PLCHOST_TRY_ASSIGN(thread_, start_clock_thread(clock_, "supervision", priority, [this] { run(); }));
  return {};
}

void Supervision::begin(const SchedulerSettings& settings, int cores) {
  for (Watched& watched : watched_) {
    const auto limit =
        cycle_limit(watched.task != nullptr ? watched.task->config() : TaskConfig{}, settings.watchdog);
    watched.lenient.store(limit && limit->lenient, std::memory_order_relaxed);
    watched.limit.store(limit ? limit->limit.count() : 0, std::memory_order_relaxed);
  }
  omitted_cycles_.store(settings.watchdog.omitted_cycles, std::memory_order_relaxed);
  const bool maximum = settings.processor_load_maximum > 0;
  const Duration window = maximum ? settings.watchdog.load_interval : settings.watchdog.default_time;
  only_overload_.store(!maximum, std::memory_order_relaxed);
  load_maximum_.store(maximum ? settings.processor_load_maximum : kOverloadPercent,
                      std::memory_order_relaxed);
  load_interval_.store(settings.watchdog.load ? window.count() : 0, std::memory_order_relaxed);
  cores_.store(cores, std::memory_order_relaxed);
  starvation_.begin(settings.watchdog.default_time);
  if (thread_.joinable()) ProcessorGuard::watch(starvation_.limit());
  forgiven_until_.store((clock_.now() + kGrace).time_since_epoch().count(), std::memory_order_relaxed);
  change(Mode::running);
}

void Supervision::change(Mode mode) noexcept {
  mode_.store(mode, std::memory_order_release);
  order_.fetch_add(1);
  clock_.wake(order_);
}

void Supervision::run() noexcept {
  while (!ending_.load(std::memory_order_acquire)) {
    const std::uint32_t order = order_.load(std::memory_order_acquire);
    const Mode mode = mode_.load(std::memory_order_acquire);
    const bool off = mode == Mode::off && !starvation_.searching();
    // When no task is released, the control thread is the one that must get the processor.
    if (mode == Mode::running) ProcessorGuard::alive();
    const TimePoint next = off ? kNoDeadline : look(clock_.now());
    next_look_.store(next == kNoDeadline ? 0 : next.time_since_epoch().count(), std::memory_order_relaxed);
    clock_.wait(order_, order, next);
    if (next == kNoDeadline) continue;
    const TimePoint woken = clock_.now();
    if (woken - next >= kToldDelay) flight_.put(woken, FlightKind::late, (woken - next).count());
  }
}

TimePoint Supervision::look(TimePoint now) noexcept {
  TimePoint next = kNoDeadline;
  for (Watched& watched : watched_) next = std::min(next, look_at(watched, now));
  const bool running = mode_.load(std::memory_order_relaxed) == Mode::running;
  if (running) next = std::min(next, look_at_load(now));
  return std::min(next, starvation_.look(now, running));
}

Duration Supervision::overdue(TimePoint now) const noexcept {
  const auto next = next_look_.load(std::memory_order_relaxed);
  if (next == 0) return Duration::zero();
  return std::max(now - TimePoint(Duration(next)), Duration::zero());
}

TimePoint Supervision::look_at(Watched& watched, TimePoint now) noexcept {
  if (watched.trap->parked()) return kNoDeadline;
  const auto since = watched.trap->running_since();
  const bool releases = watched.task != nullptr && mode_.load(std::memory_order_relaxed) == Mode::running;
  TimePoint next = since ? look_at_cycle(watched, *since, now) : kNoDeadline;
  if (!since) {
    // The next cycle may begin now, or if the task is cyclic at its release.
    const Duration limit(watched.limit.load(std::memory_order_relaxed));
    const Duration first = watched.lenient.load(std::memory_order_relaxed) ? limit / kLooks : limit;
    const TimePoint due = releases && watched.task->due() ? *watched.task->due() : now;
    if (limit > Duration::zero()) next = std::max(due, now) + first;
  }
  return releases ? std::min(next, look_at_releases(watched, now)) : next;
}

TimePoint Supervision::look_at_cycle(Watched& watched, TimePoint since, TimePoint now) noexcept {
  if (watched.struck_since == since) {
    TaskFault& fault = *watched.trap->fault();
    if (now < watched.struck_at + kPatience) return watched.struck_at + kPatience;
    // It blocks the signal, or never gets the processor. It halts at the end of its cycle. The thread that
    // reads event variables ticks for all tasks.
    const bool variable = watched.task == nullptr;
    if (fault.claim(variable)) {
      watched.trap->fill_struck(fault.record());
      fault.record().in_event_variable = variable;
      fault.record().not_caught = 1;
      fault.publish();
    }
    return kNoDeadline;
  }
  const Duration limit(watched.limit.load(std::memory_order_relaxed));
  if (limit == Duration::zero()) return kNoDeadline;
  if (watched.lenient.load(std::memory_order_relaxed)) return look_for_endless_loop(watched, since, now);
  if (now <= since + limit) return since + limit + Duration(1);
  strike(watched, since, now, FaultKind::task_watchdog, (now - since).count(), limit.count());
  return now + kPatience;
}

// The processor time of the thread counts: a host, a core or a process that stood still, and time that others
// took from it, are no fault of the cycle. A cycle that uses nothing because it waits has the same time, of
// which only what this thread has seen go by counts.
TimePoint Supervision::look_for_endless_loop(Watched& watched, TimePoint since, TimePoint now) noexcept {
  const Duration limit(watched.limit.load(std::memory_order_relaxed));
  const Duration step = limit / kLooks;
  const pid_t thread = watched.trap->thread();
  if (watched.counted_since != since) {
    if (now < since + step) return since + step;
    watched.counted_since = since;
    watched.looked_at = now;
    watched.used_before = times_.of_thread(thread);
    watched.waited = Duration::zero();
    return now + step;
  }
  watched.waited += std::min(now - std::exchange(watched.looked_at, now), step + kStandstill);
  if (watched.waited < limit) return now + step;  // nor can it have used so much
  const Duration used = times_.of_thread(thread) - watched.used_before;
  const Duration left = limit - used;
  if (left > Duration::zero() && !times_.sleeps(thread)) {
    return now + std::clamp(left, step / kLooks, step);
  }
  strike(watched, since, now, FaultKind::task_watchdog, (now - since).count(), limit.count());
  return now + kPatience;
}

TimePoint Supervision::look_at_releases(Watched& watched, TimePoint now) noexcept {
  Task& task = *watched.task;
  const auto allowed = static_cast<std::int64_t>(task.config().watchdog.omitted_cycles);
  const auto due = task.due();
  if (allowed == 0 || !due || task.fault().raised() || !omitted_cycles_.load(std::memory_order_relaxed))
    return kNoDeadline;
  const Duration interval = task.interval();
  const auto free_since = task.free_since();
  if (!free_since) return later(now, 1, interval);  // the runtime keeps it from its cycles
  const TimePoint from = std::max({*due, at(forgiven_until_), *free_since});
  const TimePoint hit = later(from, allowed, interval);
  if (now < hit) return hit;
  const std::int64_t omitted = (now - std::max(*due, *free_since)) / interval;
  if (const auto since = watched.trap->running_since()) {
    strike(watched, *since, now, FaultKind::omitted_cycles, omitted, allowed);
    return now + kPatience;
  }
  if (task.fault().claim()) {
    FaultRecord& record = task.fault().record();
    record.kind = FaultKind::omitted_cycles;
    record.figure = omitted;
    record.limit = allowed;
    task.fault().publish();
  }
  return kNoDeadline;
}

void Supervision::strike(Watched& watched, TimePoint since, TimePoint now, FaultKind kind,
                         std::int64_t figure, std::int64_t limit) noexcept {
  if (watched.struck_since == since) return;
  watched.struck_since = since;
  watched.struck_at = now;
  const auto task = static_cast<std::size_t>(&watched - watched_.data());
  flight_.put(now, FlightKind::struck, fault_figure(task, std::to_underlying(kind)));
  watched.trap->strike(since, kind, figure, limit);
}

LoadRule::Sample Supervision::sample_load() noexcept {
  for (std::size_t i = 0; i < task_times_.size(); ++i) {
    const pid_t thread = watched_[i].trap->thread();
    task_times_[i] = thread != 0 ? times_.of_thread(thread) : Duration::zero();
  }
  return {.process = times_.of_process(), .tasks = task_times_};
}

// Since it was asked last, a real-time task has lost releases before each of its cycles: it gets no further.
bool Supervision::overtaxed() noexcept {
  bool found = false;
  for (Watched& watched : watched_) {
    if (watched.task == nullptr || is_modest(watched.task->config())) continue;
    const Task::Pace before = std::exchange(watched.pace, watched.task->pace());
    found |= watched.pace.lost > before.lost && watched.pace.on_time == before.on_time;
  }
  return found;
}

TimePoint Supervision::look_at_load(TimePoint now) noexcept {
  const Duration interval(load_interval_.load(std::memory_order_relaxed));
  if (interval == Duration::zero()) return kNoDeadline;
  const auto epoch = forgiven_until_.load(std::memory_order_relaxed);
  if (const TimePoint from = at(forgiven_until_); now < from) return from;
  const bool first = std::exchange(load_epoch_, epoch) != epoch;
  if (!first && now < window_began_ + interval) return window_began_ + interval;
  window_began_ = now;
  if (only_overload_.load(std::memory_order_relaxed)) {
    look_at_overload(now, first);
  } else if (first) {
    load_.begin(now, sample_load());
  } else {
    end_window(load_, now);
  }
  return now + interval;
}

// The processor time is asked only of threads that may be over their limit: it costs a system call for each.
void Supervision::look_at_overload(TimePoint now, bool first) noexcept {
  const bool suspected = overtaxed() && !first;
  const bool measured = std::exchange(overload_measured_, suspected) && !first;
  if (!suspected) return;
  if (measured) {
    end_window(overload_, now);
  } else {
    overload_.begin(now, sample_load());
  }
}

void Supervision::end_window(LoadRule& rule, TimePoint now) noexcept {
  const int maximum = load_maximum_.load(std::memory_order_relaxed);
  const auto hit = rule.end(now, sample_load(), maximum, cores_.load(std::memory_order_relaxed));
  if (!hit) return;
  TaskFault& fault = watched_[hit->task].task->fault();
  if (!fault.claim(true)) return;
  FaultRecord& record = fault.record();
  record.kind = FaultKind::processor_load;
  record.figure = hit->percent;
  record.limit = maximum;
  fault.publish();
}

}  // namespace plchost
