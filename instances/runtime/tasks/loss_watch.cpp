#include "instances/runtime/tasks/loss_watch.hpp"

#include <algorithm>
#include <utility>

namespace plchost {

namespace {

constexpr Duration kHorizon = std::chrono::seconds(1);
// Looks between two that compare the record with the kernel's times while nothing was lost.
constexpr unsigned kCalibration = 32;
// The start of a cycle that runs lies no more entries back, unless it posts much.
constexpr std::uint64_t kBack = 16;
// Less than this of a cycle is no standstill but the kernel's rounding.
constexpr Duration kLeastStall = std::chrono::microseconds(50);
constexpr int kRounding = 4;

std::int64_t in_ns(TimePoint time) {
  return time.time_since_epoch().count();
}

}  // namespace

LossWatch::LossWatch(FlightPage& page, TaskSet& tasks, bool one_core, const ProcessorTimes& times)
    : page_(page),
      tasks_(tasks),
      one_core_(one_core),
      times_(times),
      of_task_(tasks.size()),
      from_(kFirstTaskRing + tasks.size()),
      later_(from_) {}

// Whether any has lost cycles since the last look.
bool LossWatch::ask_tasks() {
  bool lost = false;
  for (std::size_t i = 0; i < of_task_.size(); ++i) {
    OfTask& known = of_task_[i];
    const std::uint64_t now = tasks_.task(i).pace().lost;
    lost |= std::exchange(known.lost, now) != now;
    const pid_t thread = tasks_.task(i).trap().thread();
    if (i < kMostAsked && thread != 0) known.used_now = times_.of_thread(thread);
  }
  return lost;
}

void LossWatch::look(TimePoint now) {
  const bool lost = ask_tasks();
  const bool calibrates = !lost && ++looks_ % kCalibration == 2;
  if (lost || calibrates) {
    CoreRecord record = read(now, false);
    std::vector<Found> found = find_new(record);
    const auto unknown = [](const Found& one) { return one.loss.release == TimePoint{}; };
    if (std::ranges::any_of(found, unknown)) {  // older entries may tell
      record = read(now, true);
      found = find_new(record);
    }
    for (const Found& one : found) of_task_[one.task].next = one.loss.entry + 1;
    compare_times(record, now, calibrates);
    std::ranges::stable_sort(found, {}, [](const Found& one) { return one.loss.ready; });
    const std::size_t first = found.size() > kMostAtOnce ? found.size() - kMostAtOnce : 0;
    for (std::size_t i = first; i < found.size(); ++i) tell(record, found[i]);
  }
  remember(now);
}

// A count that a stranger has written leads beyond all entries that come: only until it is right again. Then
// those that are still in the ring are told, some for a second time.
std::vector<LossWatch::Found> LossWatch::find_new(const CoreRecord& record) const {
  std::vector<Found> found;
  for (std::size_t i = 0; i < of_task_.size(); ++i) {
    const std::uint64_t next = of_task_[i].next > page_.written(kFirstTaskRing + i) ? 0 : of_task_[i].next;
    for (const CoreRecord::Loss& loss : record.losses(i)) {
      if (loss.entry >= next) found.push_back({i, loss});
    }
  }
  return found;
}

// Remembered: its entry in the ring of the control thread lies ever further back.
TimePoint LossWatch::fault_of(std::size_t task) {
  TimePoint& at = of_task_[task].fault;
  const FaultRecord* const fault = tasks_.task(task).fault().published();
  if (fault != nullptr && at == TimePoint{}) at = time_of_fault(fault->unix_ns);
  return at;
}

CoreRecord LossWatch::read(TimePoint now, bool all) {
  CoreRecord record(page_.tasks(), one_core_);
  for (std::size_t i = 0; i < of_task_.size(); ++i) {
    if (const TimePoint at = fault_of(i); at != TimePoint{}) record.add_fault(i, at);
  }
  for (std::size_t ring = 0; ring < from_.size(); ++ring) {
    const std::uint64_t reached = std::min(from_[ring], page_.written(ring));  // see find_new()
    const std::uint64_t from = all ? 0 : reached - std::min(reached, kBack);
    const FlightRing::Read read = page_.read(ring, from);
    record.add(ring, read.entries, from + read.skipped);
  }
  record.complete(now);
  return record;
}

void LossWatch::compare_times(const CoreRecord& record, TimePoint now, bool calibrates) {
  for (std::size_t i = 0; i < std::min(of_task_.size(), kMostAsked); ++i) {
    OfTask& known = of_task_[i];
    known.unexplained = Duration::zero();
    if (looked_at_ == TimePoint{} || known.used == Duration::zero()) continue;
    const CoreRecord::Ended ended = record.ended(i, looked_at_, now);
    const auto cycles = static_cast<Duration::rep>(ended.cycles);
    const Duration had = record.share(i, looked_at_, now).own + ended.spun;
    const Duration used = known.used_now - known.used;
    if (calibrates && cycles > 0) known.per_cycle = std::max(used - had, Duration::zero()) / cycles;
    known.unexplained = std::max(had + cycles * known.per_cycle - used, Duration::zero());
  }
}

void LossWatch::tell(const CoreRecord& record, const Found& found) {
  const Task& task = tasks_.task(found.task);
  const CoreRecord::Loss& loss = found.loss;
  const CoreRecord::Share share = record.share(found.task, loss.release, loss.ready);
  OfTask& known = of_task_[found.task];
  Duration own_stall = std::min(share.own, known.unexplained);
  if (own_stall < std::max(kLeastStall, share.own / kRounding)) own_stall = Duration::zero();
  known.unexplained -= own_stall;
  // A task above that stood still itself kept nobody from the core.
  CoreRecord::Share parts = share;
  const Duration of_holder = std::min(share.of_holder, of_task_[share.holder].unexplained);
  if (of_holder > share.of_holder / 2) {
    parts.above -= of_holder;
    parts.none += of_holder;
  }
  LossRecord told;
  told.unix_ns = unix_time_ns();
  if (loss.release != TimePoint{}) told.unix_ns -= (MonotonicClock::now() - loss.ready).count();
  told.release_ns = in_ns(loss.release);
  told.ready_ns = in_ns(loss.ready);
  told.interval_ns = task.interval().count();
  told.lost = loss.lost;
  told.cause = cause_of(loss, parts, own_stall, task.interval());
  told.task.assign(task.config().name);
  if (told.cause == LossCause::task_above) told.holder = page_.tasks()[share.holder].name;
  told.own_ns = (parts.own - own_stall).count();
  told.above_ns = parts.above.count();
  told.stall_ns = (parts.none + own_stall).count();
  told.other_ns =
      (parts.scheduler + parts.online_change + parts.halt + parts.runtime + parts.event_variable).count();
  page_.add_loss(found.task, told);
}

void LossWatch::remember(TimePoint now) {
  for (OfTask& known : of_task_) known.used = known.used_now;
  looked_at_ = now;
  if (now < moved_ + kHorizon) return;
  moved_ = now;
  from_ = std::exchange(later_, std::vector<std::uint64_t>(from_.size()));
  for (std::size_t ring = 0; ring < later_.size(); ++ring) later_[ring] = page_.written(ring);
}

}  // namespace plchost
