#include "api/server/status/task_watch.hpp"

#include <algorithm>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

constexpr Duration kPageRetry = std::chrono::milliseconds(20);

plc_TaskStatus to_sample(const StatusTable<plc_TaskStatus>& table, const std::string& instance,
                         const TaskSnapshot& task, const StatisticsWriter::Told& told) {
  plc_TaskStatus sample = table.blank();
  dds::copy_text(sample.instance, instance);
  dds::copy_text(sample.task, task.identity.name.view());
  dds::copy_text(sample.external_event, task.identity.external_event.view());
  sample.kind = static_cast<std::uint32_t>(task.identity.kind);
  sample.priority = task.identity.iec_priority;
  sample.state = static_cast<std::uint32_t>(task.state);
  const TaskCounters& counters = task.counters;
  // The one in force, once a cycle has run.
  sample.interval_ns = counters.interval_ns > 0 ? counters.interval_ns : task.identity.interval_ns;
  sample.cycles = counters.cycles;
  sample.lost_cycles = counters.lost_cycles;
  sample.lost_events = counters.lost_events;
  sample.exec_last_ns = counters.exec_last_ns;
  sample.exec_avg_ns = average(counters.exec_sum_ns, counters.recorded);
  sample.exec_min_ns = counters.exec_min_ns;
  sample.exec_max_ns = counters.exec_max_ns;
  sample.latency_p50_ns = told.latency_p50.count();
  sample.latency_p99_ns = told.latency_p99.count();
  sample.latency_max_ns = counters.latency_max_ns;
  sample.jitter_max_ns = largest_jitter_ns(counters);
  return sample;
}

}  // namespace

bool TaskWatch::follow(const InstanceStatus& instance, TimePoint now) {
  const std::string name(instance.name.view());
  Watched& watched = instances_[name];
  bool changed = false;
  if (watched.pid != instance.pid) {
    changed = dispose_tasks(name, watched);
    watched = Watched{};
    watched.pid = instance.pid;
  }
  if (watched.page) {
    const auto runtime = watched.page->runtime();
    if (runtime && runtime->pid == watched.pid) watched.runtime = *runtime;
  }
  if (watched.pid != 0 && !watched.page && now >= watched.next_look) {
    watched.next_look = now + kPageRetry;
    if (open_page(name, watched)) {
      look_at(name, now);
      changed = true;
    }
  }
  return changed;
}

bool TaskWatch::open_page(const std::string& instance, Watched& watched) {
  auto page = InstancePageReader::open(pool_, instance);
  if (!page) return false;
  const auto runtime = page->runtime();
  // The page of the life before is there until the process has made its own.
  if (!runtime || runtime->pid != watched.pid) return false;
  watched.page = std::move(*page);
  watched.runtime = *runtime;
  watched.told.assign(watched.page->task_count(), {});
  bound_is_stale_ = true;
  return true;
}

bool TaskWatch::forget(const std::string& instance) {
  const auto found = instances_.find(instance);
  if (found == instances_.end()) return false;
  const bool changed = dispose_tasks(instance, found->second);
  instances_.erase(found);
  return changed;
}

bool TaskWatch::dispose_tasks(const std::string& instance, const Watched& watched) {
  bound_is_stale_ = true;
  for (const auto& told : watched.told) statistics_.dispose(instance, told);
  return table_->dispose_under(instance + "/");
}

std::optional<InstanceRuntime> TaskWatch::runtime(const std::string& instance) const {
  const auto found = instances_.find(instance);
  if (found == instances_.end() || !found->second.page) return std::nullopt;
  return found->second.runtime;
}

bool TaskWatch::in_exception(const std::string& instance, std::string_view task) const {
  const auto found = instances_.find(instance);
  if (found == instances_.end() || !found->second.page) return false;
  const InstancePageReader& page = *found->second.page;
  for (std::uint32_t i = 0; i < page.task_count(); ++i) {
    const auto seen = page.identity(i);
    if (seen && seen->name.view() == task) return page.task_state(i) == PageTaskState::exception;
  }
  return false;
}

std::span<const TaskWatch::BoundTask> TaskWatch::bound_tasks(std::string_view instance,
                                                             std::string_view event) const {
  if (bound_is_stale_) index_bound_tasks();
  const auto found = bound_.find(event_object_name(instance, event));
  if (found == bound_.end()) return {};
  return found->second;
}

void TaskWatch::index_bound_tasks() const {
  bound_is_stale_ = false;
  bound_.clear();
  for (const auto& [name, watched] : instances_) {
    if (!watched.page) continue;
    for (std::uint32_t i = 0; i < watched.page->task_count(); ++i) {
      const auto task = watched.page->identity(i);
      if (!task || !traits_of(task->kind).names_event) continue;
      const std::string_view event = task->external_event.view();
      const bool in_full = event.contains('/');
      bound_[in_full ? std::string(event) : event_object_name(name, event)].push_back({name, watched.pid, i});
    }
  }
}

const InstancePageReader* TaskWatch::page_of(const BoundTask& task) const {
  const auto found = instances_.find(task.instance);
  if (found == instances_.end() || found->second.pid != task.pid || !found->second.page) return nullptr;
  return &*found->second.page;
}

void TaskWatch::publish(const std::string& instance, Watched& watched, std::uint32_t index) {
  const auto task = watched.page->task(index);
  if (!task) return publish_name(instance, watched, index);
  StatisticsWriter::Told& told = watched.told[index];
  // New, or reset since: that is told at once. It costs little, because little was recorded.
  const bool at_once = told.task.empty() || told.since_ns != task->counters.since_ns;
  if (at_once) (void)statistics_.write(instance, *watched.page, index, told);
  const std::string key = instance + "/" + std::string(task->identity.name.view());
  (void)table_->update(key, to_sample(*table_, instance, *task, told));
}

// Its figures come once they can be read. That there is such a task is told at once.
void TaskWatch::publish_name(const std::string& instance, const Watched& watched, std::uint32_t index) {
  const auto known = watched.page->identity(index);
  const auto state = watched.page->task_state(index);
  if (!known || !state) return;
  const std::string key = instance + "/" + std::string(known->name.view());
  if (table_->contains(key)) return;
  const TaskSnapshot task{.identity = *known, .state = *state};
  (void)table_->update(key, to_sample(*table_, instance, task, {}));
}

void TaskWatch::look(TimePoint now) {
  std::uint32_t budget = kTasksPerLook;
  for (auto& [name, watched] : instances_) {
    if (!watched.page || now < watched.next_look) continue;
    const std::uint32_t count = watched.page->task_count();
    while (watched.next_task < count && budget > 0) {
      publish(name, watched, watched.next_task);
      ++watched.next_task;
      --budget;
    }
    if (watched.next_task < count) break;  // goes on here at the next call
    watched.next_task = 0;
    watched.next_look = now + kPeriod;
  }
  table_->write(kTasksPerLook);
  look_at_statistics(now);
}

void TaskWatch::look_at_statistics(TimePoint now) {
  std::uint32_t budget = kStatisticsPerLook;
  auto next = instances_.upper_bound(last_told_);
  for (std::size_t i = 0; i < instances_.size() && budget > 0; ++i) {
    if (next == instances_.end()) next = instances_.begin();
    auto& [name, watched] = *next++;
    if (!watched.page || now < watched.next_statistics_look) continue;
    std::uint32_t& task = watched.next_statistics;
    for (; task < watched.told.size() && budget > 0; ++task) {
      if (statistics_.write(name, *watched.page, task, watched.told[task])) --budget;
    }
    last_told_ = name;
    if (task < watched.told.size()) continue;  // goes on here when the others had their turn
    task = 0;
    watched.next_statistics_look = now + kStatisticsPeriod;
  }
}

void TaskWatch::look_at(const std::string& instance, TimePoint now) {
  const auto found = instances_.find(instance);
  if (found == instances_.end() || !found->second.page) return;
  Watched& watched = found->second;
  for (std::uint32_t i = 0; i < watched.page->task_count(); ++i) {
    publish(instance, watched, i);
  }
  watched.next_task = 0;
  watched.next_look = now + kPeriod;
  table_->write();
}

}  // namespace plchost
