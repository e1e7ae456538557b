#include "instances/runtime/application/compare_versions.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "shm/base/task_kind.hpp"

namespace plchost {

namespace {

// Collects the differences of one thing.
class Differences {
 public:
  Differences(std::vector<std::string>& lines, std::string thing) : lines_(lines), thing_(std::move(thing)) {}

  template <class Value>
  void look(std::string_view what, const Value& running, const Value& next) {
    if (running == next) return;
    lines_.push_back(fmt::format("{}: {} is {}, of the one that runs it is {}", thing_, what, next, running));
  }

 private:
  std::vector<std::string>& lines_;
  std::string thing_;
};

std::string_view yes_or_no(bool value) {
  return value ? "set" : "not set";
}

std::string in_us(Duration duration) {
  return fmt::format("{} us", std::chrono::duration<double, std::micro>(duration).count());
}

void compare_task(const TaskConfig& running, const TaskConfig& next, std::vector<std::string>& lines) {
  Differences task(lines, fmt::format("task '{}'", running.name));
  task.look("its kind", traits_of(running.kind).name, traits_of(next.kind).name);
  if (running.kind != next.kind) return;
  task.look("its priority", running.iec_priority, next.iec_priority);
  task.look("its interval", in_us(running.interval), in_us(next.interval));
  task.look("its external event", running.external_event, next.external_event);
  task.look("its start offset", in_us(running.start_offset), in_us(next.start_offset));
  task.look("LatePolicy=Asap", yes_or_no(running.late == LatePolicy::asap),
            yes_or_no(next.late == LatePolicy::asap));
  task.look("DrivesOutputs", yes_or_no(running.drives_outputs), yes_or_no(next.drives_outputs));
  const TaskWatchdog& watchdog = running.watchdog;
  task.look("its watchdog's time", in_us(watchdog.time), in_us(next.watchdog.time));
  task.look("its watchdog's sensitivity", watchdog.sensitivity, next.watchdog.sensitivity);
  task.look("its watchdog's omitted cycles", watchdog.omitted_cycles, next.watchdog.omitted_cycles);
  task.look("its watchdog's Policy=Task", yes_or_no(watchdog.policy == WatchdogPolicy::task),
            yes_or_no(next.watchdog.policy == WatchdogPolicy::task));
}

// "Main" or "Main 8+4", for outputs: the bytes that the task writes.
std::string uses_of(const DeclaredArea& area) {
  std::vector<std::string> uses;
  for (const AreaUse& use : area.uses) {
    uses.push_back(use.bytes == 0 ? use.task : fmt::format("{} {}+{}", use.task, use.offset, use.bytes));
  }
  std::ranges::sort(uses);
  return fmt::format("{}", fmt::join(uses, ", "));
}

void compare_area(const DeclaredArea& running, const DeclaredArea& next, std::vector<std::string>& lines) {
  Differences area(lines, fmt::format("area '{}'", running.name));
  area.look("dwFlags", fmt::format("{:#x}", running.flags), fmt::format("{:#x}", next.flags));
  area.look("dwBytes", running.bytes, next.bytes);
  area.look("qwLayout", running.layout, next.layout);
  area.look("the tasks that use it", uses_of(running), uses_of(next));
}

// Calls `compare` for what both have, and says what only one of them has.
template <class Thing, class Compare>
std::vector<std::string> compare_all(std::string_view what, std::span<const Thing> running,
                                     std::span<const Thing> next, const Compare& compare) {
  std::vector<std::string> lines;
  for (const Thing& thing : running) {
    const auto same = std::ranges::find(next, thing.name, &Thing::name);
    if (same == next.end()) {
      lines.push_back(fmt::format("{} '{}' is gone", what, thing.name));
    } else {
      compare(thing, *same, lines);
    }
  }
  for (const Thing& thing : next) {
    if (std::ranges::find(running, thing.name, &Thing::name) == running.end())
      lines.push_back(fmt::format("{} '{}' is new", what, thing.name));
  }
  return lines;
}

}  // namespace

std::vector<std::string> compare_tasks(std::span<const TaskConfig> running,
                                       std::span<const TaskConfig> next) {
  return compare_all("task", running, next, compare_task);
}

std::vector<std::string> compare_areas(std::span<const DeclaredArea> running,
                                       std::span<const DeclaredArea> next) {
  return compare_all("area", running, next, compare_area);
}

std::vector<std::string> compare_variables(const CarriedByName& running, const CarriedByName& next,
                                           const TypeOfVariable& running_type,
                                           const TypeOfVariable& next_type) {
  std::vector<std::string> lines;
  for (const auto& [name, carried] : running) {
    const auto same = next.find(name);
    if (same == next.end()) continue;
    if (carried.bytes == same->second.bytes && carried.layout == same->second.layout) continue;
    // Size and layout are those of the compiler: the type says more to the engineer.
    const std::string was = running_type(name);
    const std::string is = next_type(name);
    if (!was.empty() && !is.empty() && was != is) {
      lines.push_back(
          fmt::format("variable '{}': its type is {}, of the one that runs it is {}", name, is, was));
      continue;
    }
    Differences variables(lines, fmt::format("variables '{}'", name));
    variables.look("dwBytes", carried.bytes, same->second.bytes);
    variables.look("qwLayout", carried.layout, same->second.layout);
  }
  return lines;
}

}  // namespace plchost
