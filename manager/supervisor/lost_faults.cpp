#include "manager/supervisor/lost_faults.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "shm/pages/exception_history.hpp"
#include "shm/pages/flight_activity.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

namespace {

// The newest ones, in the order in which they were found.
std::vector<ExceptionEntry> faults_of(const InstancePageReader& page,
                                      const Result<FlightPageReader>& recorder) {
  std::vector<ExceptionEntry> found;
  const auto runtime = page.runtime();
  const std::string application(runtime ? runtime->application.view() : std::string_view());
  for (std::uint32_t i = 0; i < page.task_count(); ++i) {
    const auto fault = page.fault(i);
    const auto task = fault ? page.task(i) : std::nullopt;
    if (!task) continue;
    const TaskIdentity& identity = task->identity;
    ExceptionEntry& entry = found.emplace_back(exception_entry(*fault, application, identity.name.view()));
    entry.circumstances.cycles = task->counters.cycles;
    entry.circumstances.settings = task_settings(identity.kind, Duration(identity.interval_ns),
                                                 identity.iec_priority, runtime ? runtime->core : -1);
    if (runtime) entry.circumstances.scheduler = runtime->scheduler.view();
  }
  std::ranges::sort(found, {}, &ExceptionEntry::unix_ns);
  const std::size_t most = ExceptionHistory::kMaxEntries;
  if (found.size() > most) found.erase(found.begin(), found.end() - most);
  // Of these only: each reads all rings.
  for (ExceptionEntry& entry : found) {
    if (recorder) entry.activity = activity_before(*recorder, time_of_fault(entry.unix_ns));
  }
  return found;
}

}  // namespace

std::string keep_lost_faults(std::string_view pool, std::string_view run_directory,
                             std::string_view instance) {
  const auto page = InstancePageReader::open(pool, instance);
  if (!page) return {};
  const std::vector<ExceptionEntry> faults = faults_of(*page, FlightPageReader::open(pool, instance));
  if (faults.empty()) return {};
  keep_exceptions_of(run_directory, instance, faults);
  return fmt::format("task '{}': {}", faults.back().task, faults.back().text);
}

}  // namespace plchost
