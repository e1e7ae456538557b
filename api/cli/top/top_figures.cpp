#include "api/cli/top/top_figures.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"

namespace plchost {

using dds::text_of;

namespace {

constexpr double kNanosecondsOfASecond = 1e9;
constexpr double kWholeCorePercent = 100;

const LoadFigures& found_load(const std::map<std::string, LoadFigures>& loads, const std::string& name) {
  static const LoadFigures none;
  const auto found = loads.find(name);
  return found == loads.end() ? none : found->second;
}

// Adds the loads of this look to those of before. Names without one are gone.
void take_loads(std::map<std::string, LoadFigures>& kept, const std::map<std::string, double>& loads) {
  std::erase_if(kept, [&](const auto& one) { return !loads.contains(one.first); });
  for (const auto& [name, load] : loads) {
    LoadFigures& figures = kept[name];
    figures.load_percent = load;
    figures.load.add(load);
  }
}

}  // namespace

std::optional<std::int64_t> percentile_between(const plc_DurationHistogram& before,
                                               const plc_DurationHistogram& now) {
  constexpr std::uint64_t kOfAHundred = 99;
  const bool anew = now.total < before.total;
  const std::uint64_t come = anew ? now.total : now.total - before.total;
  if (come == 0) return std::nullopt;
  std::map<std::int64_t, std::uint64_t> counted;
  if (!anew) {
    for (const plc_HistogramBar& bar : dds::parts_of(before.bars)) counted[bar.lower_ns] = bar.count;
  }
  const std::uint64_t rank = (come * kOfAHundred + kOfAHundred) / (kOfAHundred + 1);  // of 1 to come
  std::uint64_t below = 0;
  std::int64_t edge = 0;
  for (const plc_HistogramBar& bar : dds::parts_of(now.bars)) {
    const auto old = counted.find(bar.lower_ns);
    const std::uint64_t there = old == counted.end() ? 0 : old->second;
    if (bar.count <= there) continue;
    edge = bar.lower_ns;
    below += bar.count - there;
    if (below >= rank) break;
  }
  return edge;
}

TopFigures::Name TopFigures::name_of(const plc_TaskStatus& task) {
  return fmt::format("{}/{}", instance_of(task), text_of(task.task));
}
TopFigures::Name TopFigures::name_of_core(const std::string& host, std::int32_t core) {
  return fmt::format("{}/{}", host, core);
}

void TopFigures::count(Counted& task, const plc_TaskStatus& status, TimePoint now) {
  auto& cycles = task.cycles;
  // A program that was loaded anew counts from 0.
  if (task.epoch != status.epoch || (!cycles.empty() && status.cycles < cycles.front().second))
    cycles.clear();
  task.epoch = status.epoch;
  cycles.emplace_front(now, status.cycles);
  while (cycles.size() > 2 && now - cycles.back().first > kWindow) cycles.pop_back();
  const double seconds = std::chrono::duration<double>(now - cycles.back().first).count();
  const auto run = static_cast<double>(status.cycles - cycles.back().second);
  task.figures.cycles_per_s = seconds > 0 ? run / seconds : 0;
  task.figures.load_percent = task.figures.cycles_per_s * static_cast<double>(status.exec_avg_ns) /
                              kNanosecondsOfASecond * kWholeCorePercent;
}

void TopFigures::take(const std::vector<HostLook>& hosts, TimePoint now) {
  std::map<Name, Counted> tasks;
  std::map<Name, double> instances;
  std::map<Name, double> cores;
  for (const HostLook& look : hosts) {
    std::map<Name, std::int32_t> core_of;
    for (const plc_InstanceStatus& instance : look.instances) {
      instances[instance_of(instance)] = 0;
      core_of[instance_of(instance)] = instance.core;
      if (instance.core >= 0) cores[name_of_core(look.host.name, instance.core)] += 0;
    }
    for (const plc_TaskStatus& task : look.tasks) {
      const Name name = name_of(task);
      Counted& counted = tasks[name];
      if (const auto old = tasks_.find(name); old != tasks_.end()) counted = std::move(old->second);
      count(counted, task, now);
      const Name instance = instance_of(task);
      const auto there = core_of.find(instance);
      if (there == core_of.end()) continue;
      instances[instance] += counted.figures.load_percent;
      if (there->second >= 0)
        cores[name_of_core(look.host.name, there->second)] += counted.figures.load_percent;
    }
  }
  tasks_ = std::move(tasks);
  take_loads(instances_, instances);
  take_loads(cores_, cores);
}

void TopFigures::take(const InstanceStatistics& statistics) {
  for (const StatisticsReport& report : statistics.tasks) {
    const plc_TaskStatistics& now = report.sample();
    const auto found =
        tasks_.find(fmt::format("{}/{}/{}", statistics.host, statistics.instance, text_of(now.task)));
    if (found == tasks_.end()) continue;
    Counted& task = found->second;
    const bool is_new = !task.statistics || task.statistics->sample().recorded != now.recorded ||
                        task.statistics->sample().since_unix_ns != now.since_unix_ns;
    if (!is_new) continue;
    task.figures.latency_p99_ns.reset();
    if (task.statistics) {
      task.figures.latency_p99_ns =
          percentile_between(task.statistics->sample().latency_histogram, now.latency_histogram);
      task.figures.latency.add(task.figures.latency_p99_ns ? static_cast<double>(*task.figures.latency_p99_ns)
                                                           : std::numeric_limits<double>::quiet_NaN());
    }
    task.statistics = report;
  }
}

const TaskFigures& TopFigures::task(const Name& name) const {
  static const TaskFigures none;
  const auto found = tasks_.find(name);
  return found == tasks_.end() ? none : found->second.figures;
}
const LoadFigures& TopFigures::instance(const Name& name) const {
  return found_load(instances_, name);
}
const LoadFigures& TopFigures::core(const Name& name) const {
  return found_load(cores_, name);
}

}  // namespace plchost
