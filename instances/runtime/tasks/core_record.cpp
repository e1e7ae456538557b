#include "instances/runtime/tasks/core_record.hpp"

#include <algorithm>
#include <utility>

namespace plchost {

namespace {

TimePoint time_of(const FlightEntry& entry) noexcept {
  return TimePoint(Duration(entry.time_ns));
}

}  // namespace

CoreRecord::CoreRecord(std::span<const FlightTask> tasks, bool one_core)
    : one_core_(one_core), tasks_(tasks.size()), known_since_(kFirstTaskRing + tasks.size()) {
  for (std::size_t i = 0; i < tasks.size(); ++i) tasks_[i].priority = tasks[i].iec_priority;
}

void CoreRecord::add(std::size_t number, std::span<const FlightEntry> entries, std::uint64_t first) {
  if (first > 0) known_since_[number] = entries.empty() ? TimePoint::max() : time_of(entries.front());
  if (number >= kFirstTaskRing) {
    add_task(tasks_[number - kFirstTaskRing], entries, first);
  } else if (number == kControlRing) {
    add_control(entries);
  } else {
    for (const FlightEntry& entry : entries) {
      if (entry.kind != FlightKind::late && entry.kind != FlightKind::polled) continue;
      const Part part = entry.kind == FlightKind::late ? Part::late : Part::variable;
      above_all_.push_back({time_of(entry) - Duration(entry.figure), time_of(entry), part});
    }
  }
}

void CoreRecord::add_control(std::span<const FlightEntry> entries) {
  for (const FlightEntry& entry : entries) {
    const TimePoint time = time_of(entry);
    const Duration lasted(entry.figure);
    if (entry.kind == FlightKind::switched) above_all_.push_back({time - lasted, time, Part::scheduler});
    if (entry.kind == FlightKind::held) above_all_.push_back({time - lasted, time, Part::online_change});
    if (entry.kind == FlightKind::started) starts_.push_back(time);
  }
}

void CoreRecord::add_task(OfTask& task, std::span<const FlightEntry> entries, std::uint64_t first) const {
  const auto begin = [&](TimePoint time, Part part) {
    task.pieces.push_back({time, time, part});
    task.open = true;
  };
  const auto end = [&](TimePoint time) {
    if (std::exchange(task.open, false)) task.pieces.back().to = time;
  };
  TimePoint release;
  TimePoint ready;
  for (const FlightEntry& entry : entries) {
    const TimePoint time = time_of(entry);
    const std::uint64_t number = first++;
    switch (entry.kind) {
      case FlightKind::lost: {
        // A cycle that never ended, or is not in the record, says nothing.
        const bool known = release != TimePoint{} && ready >= release;
        task.losses.push_back({.entry = number,
                               .lost = static_cast<std::uint64_t>(entry.figure),
                               .release = known ? release : TimePoint{},
                               .ready = known ? ready : TimePoint{}});
        break;
      }
      case FlightKind::start:
        end(time);
        release = time - Duration(entry.figure);
        ready = TimePoint{};
        begin(time, Part::cycle);
        break;
      case FlightKind::end:
        end(time);
        ready = time;
        task.ended.push_back({time, Duration(entry.figure)});
        break;
      case FlightKind::work:
        task.pieces.push_back({time - Duration(entry.figure), time, Part::work});
        ready = time;
        break;
      case FlightKind::halted:
      case FlightKind::resumed:
        end(time);
        begin(time, entry.kind == FlightKind::halted ? Part::halt : Part::cycle);
        break;
      case FlightKind::none:
      case FlightKind::taken:
      case FlightKind::posted:
      case FlightKind::moved:
      case FlightKind::fault:
      case FlightKind::started:
      case FlightKind::stopping:
      case FlightKind::switched:
      case FlightKind::held:
      case FlightKind::late:
      case FlightKind::struck:
      case FlightKind::polled:
        break;
    }
  }
}

void CoreRecord::complete(TimePoint now) {
  for (const Fault& fault : faults_) close_faulty(fault.task, fault.at);
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    OfTask& task = tasks_[i];
    if (std::exchange(task.open, false)) task.pieces.back().to = std::max(now, task.pieces.back().from);
    const TimePoint since = known_since(i);
    for (Loss& loss : task.losses) {
      if (loss.release < since) loss.release = loss.ready = TimePoint{};
      loss.started = std::ranges::any_of(
          starts_, [&](TimePoint start) { return loss.release <= start && start <= loss.ready; });
    }
  }
}

// From here on the record has all that had the core before the task. Entries that were written over would
// look as an empty core, and its loss as a stall.
TimePoint CoreRecord::known_since(std::size_t task) const {
  TimePoint since = known_since_[kFirstTaskRing + task];
  for (std::size_t ring = 0; ring < kFirstTaskRing; ++ring) since = std::max(since, known_since_[ring]);
  for (std::size_t i = 0; one_core_ && i < tasks_.size(); ++i) {
    if (tasks_[i].priority <= tasks_[task].priority)
      since = std::max(since, known_since_[kFirstTaskRing + i]);
  }
  return since;
}

// Its thread is parked in the middle of the cycle, for good.
void CoreRecord::close_faulty(std::size_t task, TimePoint at) {
  OfTask& faulty = tasks_[task];
  if (std::exchange(faulty.open, false)) faulty.pieces.back().to = std::max(at, faulty.pieces.back().from);
}

CoreRecord::Ended CoreRecord::ended(std::size_t task, TimePoint from, TimePoint to) const {
  Ended ended;
  for (const Cycle& cycle : tasks_[task].ended) {
    if (cycle.end <= from || cycle.end > to) continue;
    ++ended.cycles;
    ended.spun += cycle.spun;
  }
  return ended;
}

// Between two borders of pieces one of those that are active has the core: the runtime above all tasks, then
// the task of the highest priority. Of the same priority, the task itself: it began, and nothing pre-empts
// it.
CoreRecord::Share CoreRecord::share(std::size_t task, TimePoint from, TimePoint to) const {
  struct Border {
    TimePoint at;
    bool begins;
    std::size_t who;  // number of a task; behind these: above all
    Part part;
  };
  std::vector<Border> borders;
  const auto add = [&](std::size_t who, const Piece& piece) {
    const TimePoint begin = std::max(piece.from, from);
    const TimePoint end = std::min(piece.to, to);
    if (begin >= end) return;
    borders.push_back({begin, true, who, piece.part});
    borders.push_back({end, false, who, piece.part});
  };
  for (const Piece& piece : above_all_) add(tasks_.size(), piece);
  for (const Piece& piece : tasks_[task].pieces) add(task, piece);
  for (std::size_t i = 0; one_core_ && i < tasks_.size(); ++i) {
    if (i == task || tasks_[i].priority > tasks_[task].priority) continue;
    for (const Piece& piece : tasks_[i].pieces) {
      if (piece.part != Part::halt) add(i, piece);  // a task that halts sleeps
    }
  }
  std::ranges::sort(borders, {}, [](const Border& border) { return std::pair(border.at, border.begins); });

  struct Active {
    std::size_t who;
    Part part;
  };
  std::vector<Active> active;
  const auto rank = [&](const Active& one) {
    if (one.who == tasks_.size()) return one.part == Part::late ? -1 : -2;
    return 2 * tasks_[one.who].priority + (one.who == task ? 0 : 1);
  };
  Share share;
  std::vector<Duration> by_task(tasks_.size());
  const auto give = [&](Duration time) {
    const auto top = std::ranges::min_element(active, {}, rank);
    if (top == active.end() || top->part == Part::late) {
      share.none += time;
    } else if (top->part == Part::scheduler) {
      share.scheduler += time;
    } else if (top->part == Part::online_change) {
      share.online_change += time;
    } else if (top->part == Part::variable) {
      share.event_variable += time;
    } else if (top->who != task) {
      share.above += time;
      by_task[top->who] += time;
    } else {
      (top->part == Part::halt ? share.halt : top->part == Part::work ? share.runtime : share.own) += time;
    }
  };
  TimePoint last = from;
  for (const Border& border : borders) {
    if (border.at > last) give(border.at - last);
    last = std::max(last, border.at);
    if (border.begins) {
      active.push_back({border.who, border.part});
    } else {
      const auto same = [&](const Active& one) { return one.who == border.who && one.part == border.part; };
      active.erase(std::ranges::find_if(active, same));
    }
  }
  if (to > last) give(to - last);
  const auto most = std::ranges::max_element(by_task);
  if (most != by_task.end()) {
    share.holder = static_cast<std::size_t>(most - by_task.begin());
    share.of_holder = *most;
  }
  return share;
}

LossCause cause_of(const CoreRecord::Loss& loss, const CoreRecord::Share& share, Duration own_stall,
                   Duration interval) noexcept {
  if (loss.release == TimePoint{}) return LossCause::unknown;
  if (loss.started) return LossCause::start;
  struct Candidate {
    Duration time;
    LossCause cause;
  };
  const Candidate candidates[] = {{share.above, LossCause::task_above},
                                  {share.none + own_stall, LossCause::stall},
                                  {share.scheduler, LossCause::scheduler},
                                  {share.online_change, LossCause::online_change},
                                  {share.halt, LossCause::halt},
                                  {share.runtime, LossCause::runtime},
                                  {share.event_variable, LossCause::event_variable}};
  const Candidate most = *std::ranges::max_element(candidates, {}, &Candidate::time);
  const Duration own = share.own - own_stall;
  // A cycle that would have ended in time by itself is not to blame, however large its part is.
  const bool by_itself = own >= interval && own >= most.time;
  return by_itself || most.time == Duration::zero() ? LossCause::long_cycle : most.cause;
}

}  // namespace plchost
