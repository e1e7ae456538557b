#include "api/cli/top/top_rows.hpp"

#include <algorithm>
#include <cstdint>
#include <map>

#include <fmt/format.h>

#include "api/cli/rows/status_rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {

using dds::text_of;

namespace {

constexpr double kFullCore = 100;  // percent

struct Sums {
  std::uint64_t lost_cycles = 0;
  std::uint64_t lost_events = 0;
  std::int64_t latency_p99_ns = 0;
  std::int64_t latency_max_ns = 0;
};

std::map<std::string, Sums> sums_of(const HostLook& look) {
  std::map<std::string, Sums> sums;
  for (const plc_TaskStatus& task : look.tasks) {
    Sums& sum = sums[std::string(text_of(task.instance))];
    sum.lost_cycles += task.lost_cycles;
    sum.lost_events += task.lost_events;
    sum.latency_p99_ns = std::max(sum.latency_p99_ns, std::int64_t{task.latency_p99_ns});
    sum.latency_max_ns = std::max(sum.latency_max_ns, std::int64_t{task.latency_max_ns});
  }
  return sums;
}

std::uint64_t exceptions_of(const HostLook& look, std::string_view instance) {
  for (const plc_ExceptionStatus& one : look.exceptions) {
    if (text_of(one.instance) == instance) return one.count;
  }
  return 0;
}

// All that is known of a silent host is old.
Row state_of(const HostLook& look, const Row& row) {
  return look.host.silent ? Row("silent") : row.at("state");
}

}  // namespace

TopTable instance_table(const std::vector<HostLook>& hosts, const TopFigures& figures,
                        const TrendStyle& style) {
  TopTable table{.rows = {},
                 .columns = {{"host", "HOST", 1, 1},
                             {"instance", "INSTANCE"},
                             {"state", "STATE"},
                             {"core", "CORE", 1, 4, -1},
                             {"scheduler", "SCHEDULER", 1, 7},
                             {"load_percent", "LOAD%", 1},
                             {"load_trend", "LOAD", 1, 6},
                             {"latency_p99_us", "LAT-P99(us)", 1, 3},
                             {"latency_max_us", "LAT-MAX(us)", 1, 5},
                             {"lost_cycles", "LOST"},
                             {"lost_events", "LOST-EV", 1, 2},
                             {"exceptions", "EXC"},
                             {"problem", "PROBLEM", 1, 8}}};
  for (const HostLook& look : hosts) {
    const auto sums = sums_of(look);
    for (const plc_InstanceStatus& status : look.instances) {
      const Row told = to_row(status);
      const std::string name = TopFigures::instance_of(status);
      const LoadFigures& load = figures.instance(name);
      const auto sum = sums.find(std::string(text_of(status.instance)));
      const Sums none;
      const Sums& of_tasks = sum == sums.end() ? none : sum->second;
      table.rows.push_back({{"name", name},
                            {"host", look.host.name},
                            {"instance", text_of(status.instance)},
                            {"state", state_of(look, told)},
                            {"core", status.core},
                            {"scheduler", text_of(status.scheduler)},
                            {"load_percent", load.load_percent},
                            {"load_trend", load.load.line(style.width, style.unicode, kFullCore)},
                            {"latency_p99_us", to_us(of_tasks.latency_p99_ns)},
                            {"latency_max_us", to_us(of_tasks.latency_max_ns)},
                            {"lost_cycles", of_tasks.lost_cycles},
                            {"lost_events", of_tasks.lost_events},
                            {"exceptions", exceptions_of(look, text_of(status.instance))},
                            {"problem", text_of(status.problem)}});
    }
  }
  return table;
}

TopTable task_table(const std::vector<HostLook>& hosts, const TopFigures& figures, const TrendStyle& style,
                    const std::string& instance) {
  TopTable table{.rows = {},
                 .columns = {{"task", "TASK"},
                             {"state", "STATE", 1, 3},
                             {"kind", "KIND", 1, 7},
                             {"priority", "PRIO", 1, 5},
                             {"interval_us", "INTERVAL(us)", 0, 6},
                             {"cycles_per_s", "CYCLES/s", 0},
                             {"load_percent", "LOAD%", 1},
                             {"exec_avg_us", "EXEC-AVG(us)", 1, 9},
                             {"exec_max_us", "EXEC-MAX(us)", 1, 8},
                             {"latency_p99_us", "LAT-P99(us)", 1},
                             {"latency_max_us", "LAT-MAX(us)", 1, 2},
                             {"lost_cycles", "LOST"},
                             {"lost_events", "LOST-EV", 1, 1}}};
  if (instance.empty()) {
    table.columns.insert(table.columns.begin(), {{"host", "HOST", 1, 4}, {"instance", "INSTANCE"}});
  } else {
    table.columns.insert(table.columns.begin() + 10,
                         {{"latency_now_us", "NOW-P99(us)", 1, 1}, {"latency_trend", "LATENCY", 1, 2}});
  }
  for (const HostLook& look : hosts) {
    for (const plc_TaskStatus& status : look.tasks) {
      const std::string name = TopFigures::name_of(status);
      if (!instance.empty() && !name.starts_with(instance + '/')) continue;
      const TaskFigures& task = figures.task(name);
      Row row = {{"name", name}};
      const Row told = to_row(status);
      for (const auto& [field, value] : told.items()) row[field] = value;
      row["state"] = state_of(look, told);
      row["cycles_per_s"] = task.cycles_per_s;
      row["load_percent"] = task.load_percent;
      row["latency_now_us"] = task.latency_p99_ns ? Row(to_us(*task.latency_p99_ns)) : Row();
      row["latency_trend"] = task.latency.line(style.width, style.unicode);
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

TopTable core_table(const std::vector<HostLook>& hosts, const TopFigures& figures, const TrendStyle& style) {
  TopTable table{.rows = {},
                 .columns = {{"host", "HOST"},
                             {"core", "CORE"},
                             {"load_percent", "LOAD%", 1},
                             {"load_trend", "LOAD", 1, 3},
                             {"host_load", "HOST-LOAD", 2, 2},
                             {"instances", "INSTANCES"}}};
  for (const HostLook& look : hosts) {
    std::map<std::int32_t, std::string> there;
    for (const plc_InstanceStatus& status : look.instances) {
      if (status.core < 0) continue;
      std::string& names = there[status.core];
      names += fmt::format("{}{}", names.empty() ? "" : ", ", text_of(status.instance));
    }
    for (const auto& [core, names] : there) {
      const std::string name = TopFigures::name_of_core(look.host.name, core);
      const LoadFigures& load = figures.core(name);
      const bool is_known = look.host.status.load_percent >= 0;
      table.rows.push_back({{"name", name},
                            {"host", look.host.name},
                            {"core", core},
                            {"load_percent", load.load_percent},
                            {"load_trend", load.load.line(style.width, style.unicode, kFullCore)},
                            {"host_load", is_known ? Row(look.host.status.load_percent / kFullCore) : Row()},
                            {"instances", names}});
    }
  }
  return table;
}

TopTable loss_table(const std::vector<HostLook>& hosts, const std::string& instance) {
  std::vector<plc_LossStatus> losses;
  for (const HostLook& look : hosts) {
    for (const plc_LossStatus& loss : look.losses) {
      if (TopFigures::instance_of(loss) == instance) losses.push_back(loss);
    }
  }
  std::ranges::sort(losses, std::greater(), &plc_LossStatus::number);
  TopTable table{.rows = {}, .columns = {}};
  for (const plc_LossStatus& loss : losses) table.rows.push_back(to_row(loss));
  // Of one instance.
  for (const Column& column : columns_of<plc_LossStatus>()) {
    const std::string_view field = column.field;
    if (field != "host" && field != "instance") table.columns.push_back(column);
  }
  return table;
}

std::string exception_line(const std::vector<HostLook>& hosts, const std::string& instance) {
  for (const HostLook& look : hosts) {
    for (const plc_ExceptionStatus& one : look.exceptions) {
      if (one.count == 0 || TopFigures::instance_of(one) != instance) continue;
      const Row row = to_row(one);
      return fmt::format("exception {}: {} {} of {} {}", one.count, row.value("time", ""),
                         row.value("kind", ""), one.task[0] == 0 ? "no task" : text_of(one.task),
                         one.present ? "(in force)" : "(before this start)");
    }
  }
  return {};
}

}  // namespace plchost
