#include "shm/pages/flight_activity.hpp"

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "shm/base/fault_record.hpp"

namespace plchost {

namespace {

struct Moment {
  std::size_t ring = 0;
  std::size_t number = 0;  // among those of its ring
  FlightEntry entry;

  // In the order of the times; in a ring those of one time stay as they are.
  [[nodiscard]] auto order() const noexcept { return std::tuple(entry.time_ns, ring, number); }
};

// Of one instance: the names of its tasks, and the events that they run for.
struct Names {
  std::vector<std::string> tasks;
  std::vector<std::uint32_t> marks;

  [[nodiscard]] std::string of_ring(std::size_t ring) const {
    switch (ring) {
      case kControlRing:
        return "runtime";
      case kWatchRing:
        return "supervision";
      case kPollRing:
        return "event variables";
      default:
        return of_task(static_cast<std::int64_t>(ring - kFirstTaskRing));
    }
  }
  [[nodiscard]] std::string of_task(std::int64_t task) const {
    const bool known = task >= 0 && std::cmp_less(task, tasks.size());
    return known ? tasks[static_cast<std::size_t>(task)] : fmt::format("task {}", task);
  }
  [[nodiscard]] std::string of_event(std::int64_t figure) const {
    const auto mark = static_cast<std::uint32_t>(figure >> 32) & kEventMarkMask;
    const auto found = std::ranges::find(marks, mark);
    if (mark == 0 || found == marks.end()) return "an event of another instance, or of no task";
    return fmt::format("the event of {}", tasks[static_cast<std::size_t>(found - marks.begin())]);
  }
  // "task_watchdog of Fill"
  [[nodiscard]] std::string of_fault(std::int64_t figure) const {
    const auto kind = static_cast<FaultKind>(figure & 0xff);
    return fmt::format("{} of {}", to_string(kind), of_task(figure >> 8));
  }
};

std::string us(std::int64_t ns) {
  constexpr double kNsPerUs = 1e3;
  return fmt::format("{:.1f} us", static_cast<double>(ns) / kNsPerUs);
}

std::uint32_t count_of_post(std::int64_t figure) noexcept {
  return static_cast<std::uint32_t>(figure);
}

// Empty: it is none, as a stranger may have written it.
std::string words_of(const FlightEntry& entry, const Names& names) {
  const std::int64_t figure = entry.figure;
  switch (entry.kind) {
    case FlightKind::none:
      return {};
    case FlightKind::start:
      return fmt::format("start, {} after its release", us(figure));
    case FlightKind::end:
      return figure == 0 ? "end" : fmt::format("end, {} were spun before its start", us(figure));
    case FlightKind::lost:
      return fmt::format("{} releases are lost", figure);
    case FlightKind::taken:
      return fmt::format("takes post {}", figure);
    case FlightKind::posted:
      return fmt::format("posts {}, post {}", names.of_event(figure), count_of_post(figure));
    case FlightKind::moved:
      return fmt::format("next release moved by {}", us(figure));
    case FlightKind::work:
      return fmt::format("the runtime's work has taken {}", us(figure));
    case FlightKind::halted:
      return "halted by a debugger";
    case FlightKind::resumed:
      return "goes on";
    case FlightKind::fault:
      return fmt::format("exception, {}", names.of_fault(figure));
    case FlightKind::started:
      return "all tasks are released";
    case FlightKind::stopping:
      return "all tasks are to park";
    case FlightKind::switched:
      return fmt::format("the scheduler was exchanged in {}", us(figure));
    case FlightKind::held:
      return fmt::format("all tasks waited between two cycles for {}", us(figure));
    case FlightKind::late:
      return fmt::format("woke {} late", us(figure));
    case FlightKind::struck:
      return fmt::format("a watchdog has hit, {}", names.of_fault(figure));
    case FlightKind::polled:
      return fmt::format("were read in {}", us(figure));
  }
  return {};
}

// As many of each ring as have room in all; at least two.
std::size_t share_of(std::size_t rings) noexcept {
  return std::max<std::size_t>(2, kMostActivity / rings);
}

template <class Page>
std::vector<Moment> last_moments(const Page& page, std::size_t rings, std::int64_t until_ns) {
  std::vector<Moment> all;
  for (std::size_t ring = 0; ring < rings; ++ring) {
    auto entries = page.read(ring, 0).entries;
    std::erase_if(entries, [&](const FlightEntry& entry) {
      return entry.kind == FlightKind::none || entry.time_ns < 0 || entry.time_ns > until_ns;
    });
    const std::size_t share = std::min(entries.size(), share_of(rings));
    for (std::size_t i = entries.size() - share; i < entries.size(); ++i)
      all.push_back({ring, i, entries[i]});
  }
  std::ranges::sort(all, {}, &Moment::order);
  if (all.size() > kMostActivity) all.erase(all.begin(), all.end() - kMostActivity);
  return all;
}

template <class Page>
std::vector<std::string> activity_of(const Page& page, const Names& names, TimePoint until) {
  constexpr double kNsPerMs = 1e6;
  const std::int64_t until_ns = until.time_since_epoch().count();
  std::vector<std::string> lines;
  for (const Moment& moment : last_moments(page, kFirstTaskRing + names.tasks.size(), until_ns)) {
    const std::string words = words_of(moment.entry, names);
    if (words.empty()) continue;
    lines.push_back(fmt::format("-{:.3f} ms {}: {}",
                                static_cast<double>(until_ns - moment.entry.time_ns) / kNsPerMs,
                                names.of_ring(moment.ring), words));
  }
  return lines;
}

}  // namespace

std::vector<std::string> activity_before(const FlightPage& page, TimePoint until) {
  Names names;
  for (const FlightTask& task : page.tasks()) {
    names.tasks.emplace_back(task.name.view());
    names.marks.push_back(task.event_mark);
  }
  return activity_of(page, names, until);
}

std::vector<std::string> activity_before(const FlightPageReader& page, TimePoint until) {
  Names names;
  for (std::size_t task = 0; task < page.task_count(); ++task) {
    names.tasks.push_back(page.task_name(task));
    names.marks.push_back(page.event_mark(task));
  }
  return activity_of(page, names, until);
}

}  // namespace plchost
