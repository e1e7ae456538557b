#include "schedulers/task_set.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "schedulers/tasks/priorities.hpp"
#include "shm/base/names.hpp"

namespace plchost {

TaskSet::TaskSet(Clock& clock, PriorityBand band, TaskEnvironment environment, UniqueFd fault_fd)
    : clock_(clock),
      band_(band),
      environment_(std::move(environment)),
      fault_fd_(std::move(fault_fd)),
      fault_board_(fault_fd_.get()) {}

TaskSet::~TaskSet() {
  if (supervision_ && running_) supervision_->tasks_stop();
  ticker_.use(nullptr);
  (void)ticker_.settled(kNoDeadline);
  for (auto& thread : threads_) thread->park();  // all at once; their destructors then wait one by one
}

Result<std::unique_ptr<TaskSet>> TaskSet::create(Clock& clock, PriorityBand band,
                                                 std::vector<TaskConfig> tasks, TaskEnvironment environment) {
  PLCHOST_TRY(check_tasks(tasks));
  UniqueFd fault_fd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!fault_fd) return failure(ErrorCode::system, "cannot create an event descriptor for faults", errno);
  std::unique_ptr<TaskSet> self(new TaskSet(clock, band, std::move(environment), std::move(fault_fd)));
  self->fault_board_.tell(self->environment_.halted);
  self->poller_.tell_in(self->environment_.poll_flight);
  for (TaskConfig& config : tasks) {
    const std::string step = fmt::format("task '{}'", config.name);
    PLCHOST_TRY(in_step(step, self->add(std::move(config))));
  }
  const ThreadPriority tick = self->environment_.allow_unprivileged ? ThreadPriority{} : tick_priority(band);
  PLCHOST_TRY(in_step("tick", self->ticker_.start_thread(tick)));
  if (self->environment_.catch_faults) {
    PLCHOST_TRY(self->supervise());
  }
  return self;
}

Result<void> TaskSet::supervise() {
  if (auto installed = install_fault_handlers(); !installed) return installed;
  supervision_.emplace(clock_, tasks_, poller_.trap());
  supervision_->tell_in(environment_.watch_flight);
  return supervision_->start_thread(environment_.allow_unprivileged ? ThreadPriority{}
                                                                    : supervision_priority(band_));
}

Result<void> TaskSet::add(TaskConfig config) {
  CountedEvent* event = nullptr;
  if (traits_of(config.kind).names_event) {
    PLCHOST_TRY_ASSIGN(event, environment_.find_event(config.external_event));
  }
  const ThreadPriority priority =
      environment_.allow_unprivileged ? ThreadPriority{} : task_priority(band_, config.iec_priority);
  tasks_.push_back(std::make_unique<Task>(clock_, std::move(config), environment_.statistics(tasks_.size()),
                                          event, &fault_board_));
  tasks_.back()->pass(gate_);
  if (environment_.fault_record) {
    tasks_.back()->fault().show_in(&environment_.fault_record(tasks_.size() - 1));
  }
  if (environment_.flight) tasks_.back()->tell_in(environment_.flight(tasks_.size() - 1));
  Task& task = *tasks_.back();
  if (task.kind().has_grid) task.follow(distributed_clock_.add_follower(task.config().iec_priority));
  if (task.latch() != nullptr) poller_.add(task);
  PLCHOST_TRY_ASSIGN(auto thread, TaskThread::start(clock_, task, priority));
  threads_.push_back(std::move(thread));
  reported_running_.push_back(false);
  fault_taken_.push_back(false);
  return {};
}

// Before anything is released: the first cycle may be an endless one, and then nobody else comes to run here.
void TaskSet::watch(const SchedulerSettings& settings) {
  if (!supervision_) return;
  const auto cores = allowed_cores(0);
  supervision_->begin(settings, cores ? static_cast<int>(cores->size()) : 1);
}

// No release is due yet, so none is missed.
void TaskSet::watch_variables(const SchedulerSettings& settings) {
  watch(settings);
  if (supervision_) supervision_->tasks_stop();
}

Result<void> TaskSet::reset_statistics(std::string_view task) {
  std::vector<std::string_view> names;
  for (auto& known : tasks_) {
    names.emplace_back(known->config().name);
    if (!task.empty() && task != names.back()) continue;
    if (auto done = reset_statistics(*known); !done || !task.empty()) return done;
  }
  if (task.empty()) return {};
  return failure(ErrorCode::not_found, fmt::format("no task '{}'; there are: {}", task, join_names(names)));
}

// A task that records is about to be through with it; only a higher priority can keep it from that.
Result<void> TaskSet::reset_statistics(Task& task) {
  const TimePoint deadline = MonotonicClock::now() + kRecordPatience;
  while (!task.reset_statistics()) {
    if (MonotonicClock::now() >= deadline) {
      return failure(
          ErrorCode::timed_out,
          fmt::format("task '{}' is kept from ending the record of its cycle", task.config().name));
    }
    std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
  return {};
}

void TaskSet::hand_out_sources() {
  scheduler_name_ = active_->scheduler->name();
  for (std::size_t i = 0; i < threads_.size(); ++i) threads_[i]->use(active_->sources[i].get());
}

void TaskSet::report(std::size_t index, bool running) {
  if (reported_running_[index] == running || tasks_[index]->fault().raised()) return;
  reported_running_[index] = running;
  if (environment_.state_changed) environment_.state_changed(index, running);
}

// The old one is free to go when no thread uses it any more.
bool TaskSet::let_retired_go() {
  if (!ticker_.settled(TimePoint{})) return false;
  const bool ticks = running_ && active_->plan.source;
  if (!ticks && tick_.device) tick_.device->halt();  // nobody waits for its interrupts
  retired_.clear();
  return true;
}

// The names of the tasks that are not settled at the deadline, in their cycles or in an event variable.
std::vector<std::string_view> TaskSet::wait_until_settled(TimePoint deadline) {
  std::vector<std::string_view> busy;
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    if (!threads_[i]->settled(deadline)) {
      busy.emplace_back(tasks_[i]->config().name);
    } else {
      report(i, running_);
    }
  }
  if (!ticker_.settled(deadline)) {
    const auto late = task_in_variable();
    if (late && std::ranges::find(busy, tasks_[*late]->config().name) == busy.end())
      busy.emplace_back(tasks_[*late]->config().name);
  }
  if (busy.empty()) (void)let_retired_go();
  return busy;
}

std::optional<Duration> TaskSet::between_cycles(const std::function<void()>& action) {
  // Before anybody has to wait for it.
  if (!tasks_in_cycle().empty()) return std::nullopt;
  // Nothing but the tasks, which then wait at the gate, may make the moment longer.
  const RaisedPriority raised(environment_.allow_unprivileged ? ThreadPriority{} : switch_priority(band_));
  const TimePoint closed = MonotonicClock::now();
  gate_.close();
  const bool alone = tasks_in_cycle().empty();
  if (alone) action();
  gate_.open(clock_);
  const TimePoint opened = MonotonicClock::now();
  environment_.control_flight.put(opened, FlightKind::held, (opened - closed).count());
  if (!alone) return std::nullopt;
  return opened - closed;
}

bool TaskSet::stands_still() const noexcept {
  return std::ranges::any_of(tasks_, [](const auto& task) { return task->trap().seat().is_still(); });
}

std::vector<std::string_view> TaskSet::tasks_in_cycle() const {
  std::vector<std::string_view> names;
  for (const auto& task : tasks_) {
    if (task->in_cycle() && !task->trap().parked()) names.emplace_back(task->config().name);
  }
  if (names.empty() && poller_.trap().seat().taken() && !poller_.parked())
    names.emplace_back("event variables");
  return names;
}

std::optional<TaskSet::Fault> TaskSet::take_fault() {
  // Emptied first: a fault that comes while we look makes it readable again.
  std::uint64_t told = 0;
  (void)!::read(fault_fd_.get(), &told, sizeof told);
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    const FaultRecord* const record = tasks_[i]->fault().published();
    if (record == nullptr || fault_taken_[i]) continue;
    fault_taken_[i] = true;
    const TimePoint time = time_of_fault(record->unix_ns);
    environment_.control_flight.put(time, FlightKind::fault,
                                    fault_figure(i, std::to_underlying(record->kind)));
    return Fault{.task = i,
                 .name = tasks_[i]->config().name,
                 .record = *record,
                 .time = time,
                 .back_trace = tasks_[i]->fault().back_trace(),
                 .whole_application = fault_board_.halted()};
  }
  return std::nullopt;
}

void TaskSet::look_after_posts() noexcept {
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    if (threads_[i]->rests()) {
      tasks_[i]->lose_posts();
    } else {
      tasks_[i]->rouse();
    }
  }
}

std::vector<std::string_view> TaskSet::tasks_in_exception() const {
  std::vector<std::string_view> names;
  for (const auto& task : tasks_) {
    if (task->fault().raised()) names.emplace_back(task->config().name);
  }
  return names;
}

bool TaskSet::has_parked_thread() const noexcept {
  return poller_.parked() ||
         std::ranges::any_of(tasks_, [](const auto& task) { return task->trap().parked(); });
}

}  // namespace plchost
