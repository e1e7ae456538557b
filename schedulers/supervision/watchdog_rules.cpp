#include "schedulers/supervision/watchdog_rules.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

namespace plchost {

namespace {

std::string describe(const std::optional<CycleLimit>& limit) {
  if (!limit) return "a cycle may take as long as it likes";
  return fmt::format("a cycle may take {:.10g} ms ({})",
                     std::chrono::duration<double, std::milli>(limit->limit).count(),
                     limit->lenient ? "the guard against endless loops" : "the task's own watchdog");
}

std::string some_of(std::span<const std::string_view> names) {
  constexpr std::size_t kShown = 8;
  const std::string shown = fmt::format("{}", fmt::join(names.first(std::min(names.size(), kShown)), ", "));
  return names.size() <= kShown ? shown : fmt::format("{} and {} more", shown, names.size() - kShown);
}

}  // namespace

std::optional<CycleLimit> cycle_limit(const TaskConfig& task, const WatchdogSettings& settings) noexcept {
  if (task.watchdog.time > Duration::zero()) {
    return CycleLimit{.limit = task.watchdog.time * task.watchdog.sensitivity, .lenient = false};
  }
  if (settings.default_time == Duration::zero()) return std::nullopt;
  // A task with a long interval may well compute longer, but an endless loop has the core until it is found.
  const Duration most = settings.default_time * kMostStretch;
  return CycleLimit{.limit = std::clamp(task.interval, settings.default_time, most), .lenient = true};
}

std::vector<std::string> describe_cycle_limits(std::span<const TaskConfig> tasks,
                                               const WatchdogSettings& settings) {
  struct Group {
    std::optional<CycleLimit> limit;
    std::vector<std::string_view> names;
  };
  std::vector<Group> groups;
  for (const TaskConfig& task : tasks) {
    const auto limit = cycle_limit(task, settings);
    auto found = std::ranges::find(groups, limit, &Group::limit);
    if (found == groups.end()) found = groups.insert(found, Group{.limit = limit, .names = {}});
    found->names.push_back(task.name);
  }
  std::vector<std::string> lines;
  for (const Group& group : groups) {
    lines.push_back(fmt::format("{}: task {}", describe(group.limit), some_of(group.names)));
  }
  return lines;
}

void LoadRule::begin(TimePoint now, const Sample& sample) {
  begun_ = now;
  process_ = sample.process;
  tasks_.assign(sample.tasks.begin(), sample.tasks.end());
}

std::optional<LoadRule::Hit> LoadRule::end(TimePoint now, const Sample& sample, int maximum, int cores) {
  const Duration window = now - begun_;
  Duration used = sample.process - process_;
  Duration most{};
  std::size_t culprit = 0;
  for (std::size_t i = 0; i < sample.tasks.size(); ++i) {
    const Duration own = sample.tasks[i] - tasks_[i];
    if (left_out_[i]) {
      used -= own;
    } else if (own > most) {
      most = own;
      culprit = i;
    }
  }
  begin(now, sample);
  if (window <= Duration::zero()) return std::nullopt;
  const Duration load = std::max(most, used / std::max(cores, 1));
  const auto percent = static_cast<int>(load * 100 / window);
  if (percent <= maximum) return std::nullopt;
  return Hit{.percent = percent, .task = culprit};
}

}  // namespace plchost
