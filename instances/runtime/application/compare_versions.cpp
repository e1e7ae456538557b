#include "instances/runtime/application/compare_versions.hpp"

#include <algorithm>
#include <iterator>
#include <map>

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

using SeenSymbols =
    std::map<std::string, const VariableSymbol*, decltype([](const auto& left, const auto& right) {
               return compare_variable_names(left, right) < 0;
             })>;

template <class Of>
SeenSymbols seen_symbols(std::span<const VariableSymbol> all, const Of& of) {
  SeenSymbols symbols;
  for (const VariableSymbol& symbol : all) {
    if (of(symbol)) symbols.emplace(symbol.name, &symbol);
  }
  return symbols;
}

// In the words of the source: a variable is new, gone, or of another type. `of` says which are meant.
template <class Of>
std::vector<std::string> compare_seen(const SeenByBoth& seen, std::string_view kind, const Of& of) {
  std::vector<std::string> lines;
  const SeenSymbols running = seen_symbols(seen.running, of);
  const SeenSymbols next = seen_symbols(seen.next, of);
  for (const auto& [name, symbol] : running) {
    const auto same = next.find(name);
    if (same == next.end()) {
      lines.push_back(fmt::format("{}variable '{}' is gone", kind, name));
    } else {
      Differences(lines, fmt::format("{}variable '{}'", kind, name))
          .look("its type", type_text(*symbol), type_text(*same->second));
    }
  }
  for (const auto& [name, symbol] : next) {
    if (!running.contains(name)) lines.push_back(fmt::format("{}variable '{}' is new", kind, name));
  }
  return lines;
}

void compare_area(const DeclaredArea& running, const DeclaredArea& next, const SeenByBoth& seen,
                  std::vector<std::string>& lines) {
  Differences area(lines, fmt::format("area '{}'", running.name));
  area.look("dwFlags", fmt::format("{:#x}", running.flags), fmt::format("{:#x}", next.flags));
  if (running.bytes != next.bytes || running.layout != next.layout) {
    const auto variables =
        compare_seen(seen, fmt::format("area '{}': ", running.name),
                     [&](const VariableSymbol& symbol) { return symbol.area == running.name; });
    std::ranges::copy(variables, std::back_inserter(lines));
    if (variables.empty()) {
      area.look("dwBytes", running.bytes, next.bytes);
      area.look("qwLayout", running.layout, next.layout);
    }
  }
  area.look("the tasks that use it", uses_of(running), uses_of(next));
}

// Those whose names begin with that one.
std::span<const VariableSymbol> begin_with(std::span<const VariableSymbol> all, std::string_view name) {
  const auto begin_of = [&](const VariableSymbol& symbol) {
    return std::string_view(symbol.name).substr(0, name.size());
  };
  const auto less = [](std::string_view left, std::string_view right) {
    return compare_variable_names(left, right) < 0;
  };
  return std::ranges::equal_range(all, name, less, begin_of);
}

// "Main.part" is that of "Main.part", "Main.part.hours" and "Main.part[].x".
bool is_part_of(std::string_view name, std::string_view whole) {
  if (name.size() > whole.size() && name[whole.size()] != '.' && name[whole.size()] != '[') return false;
  return same_variable_name(name.substr(0, whole.size()), whole);
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
                                       std::span<const DeclaredArea> next, const SeenByBoth& seen) {
  return compare_all("area", running, next,
                     [&](const DeclaredArea& one, const DeclaredArea& other,
                         std::vector<std::string>& lines) { compare_area(one, other, seen, lines); });
}

std::vector<std::string> compare_variables(const CarriedByName& running, const CarriedByName& next,
                                           const SeenByBoth& seen) {
  std::vector<std::string> lines;
  for (const auto& [name, carried] : running) {
    const auto same = next.find(name);
    if (same == next.end()) continue;
    if (carried.bytes == same->second.bytes && carried.layout == same->second.layout) continue;
    const SeenByBoth whole{.running = begin_with(seen.running, name), .next = begin_with(seen.next, name)};
    const auto members =
        compare_seen(whole, "", [&](const VariableSymbol& symbol) { return is_part_of(symbol.name, name); });
    std::ranges::copy(members, std::back_inserter(lines));
    if (!members.empty()) continue;
    Differences variables(lines, fmt::format("variables '{}'", name));
    variables.look("dwBytes", carried.bytes, same->second.bytes);
    variables.look("qwLayout", carried.layout, same->second.layout);
  }
  return lines;
}

}  // namespace plchost
