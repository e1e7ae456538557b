#include "api/server/task_watch.hpp"

#include <algorithm>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

constexpr Duration kPageRetry = std::chrono::milliseconds(20);

plc_TaskStatus to_sample(const std::string& host, const std::string& instance, std::uint64_t epoch,
                         const TaskSnapshot& task, const HistogramView& latency) {
  plc_TaskStatus sample{};
  dds::copy_text(sample.host, host);
  dds::copy_text(sample.instance, instance);
  dds::copy_text(sample.task, task.identity.name.view());
  dds::copy_text(sample.external_event, task.identity.external_event.view());
  sample.epoch = epoch;
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
  sample.latency_p50_ns = latency.percentile(0.5).count();
  sample.latency_p99_ns = latency.percentile(0.99).count();
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
    changed = table_.dispose_under(name + "/");
    watched = Watched{};
    watched.pid = instance.pid;
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
  return true;
}

bool TaskWatch::forget(const std::string& instance) {
  instances_.erase(instance);
  return table_.dispose_under(instance + "/");
}

std::optional<InstanceRuntime> TaskWatch::runtime(const std::string& instance) const {
  const auto found = instances_.find(instance);
  if (found == instances_.end() || !found->second.page) return std::nullopt;
  return found->second.page->runtime();
}

void TaskWatch::publish(const std::string& instance, const InstancePageReader& page, std::uint32_t index) {
  const auto task = page.task(index);
  if (!task) return;
  const std::string key = instance + "/" + std::string(task->identity.name.view());
  const HistogramView latency = page.histogram(index, TaskHistogram::latency);
  (void)table_.update(key, to_sample(host_, instance, epoch_, *task, latency));
}

void TaskWatch::look(TimePoint now) {
  std::uint32_t budget = kTasksPerLook;
  for (auto& [name, watched] : instances_) {
    if (!watched.page || now < watched.next_look) continue;
    const std::uint32_t count = watched.page->task_count();
    while (watched.next_task < count && budget > 0) {
      publish(name, *watched.page, watched.next_task);
      ++watched.next_task;
      --budget;
    }
    if (watched.next_task < count) break;  // goes on here at the next call
    watched.next_task = 0;
    watched.next_look = now + kPeriod;
  }
  table_.write(kTasksPerLook);
}

void TaskWatch::look_at(const std::string& instance, TimePoint now) {
  const auto found = instances_.find(instance);
  if (found == instances_.end() || !found->second.page) return;
  Watched& watched = found->second;
  for (std::uint32_t i = 0; i < watched.page->task_count(); ++i) {
    publish(instance, *watched.page, i);
  }
  watched.next_task = 0;
  watched.next_look = now + kPeriod;
  table_.write();
}

}  // namespace plchost
