#include "tests/bench/machine_watch.hpp"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

#include <stdlib.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

namespace plchost::bench {

namespace {

/// Of all cores since the machine was started, in seconds.
struct CoreTimes {
  double all = 0;
  double busy = 0;
  double steal = 0;
};

CoreTimes core_times() {
  constexpr std::size_t kIdle = 3, kWait = 4, kSteal = 7, kFields = 8;  // of proc_stat(5), without guests
  std::ifstream file("/proc/stat");
  std::string name;
  file >> name;
  const double ticks = static_cast<double>(::sysconf(_SC_CLK_TCK));
  CoreTimes times;
  for (std::size_t field = 0; field < kFields; ++field) {
    double value = 0;
    file >> value;
    value /= ticks;
    times.all += value;
    if (field == kSteal) times.steal = value;
    if (field != kIdle && field != kWait && field != kSteal) times.busy += value;
  }
  return times;
}

/// Of this process and of those that it has waited for.
double own_cpu() {
  double seconds = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    for (const timeval& time : {usage.ru_utime, usage.ru_stime}) {
      seconds += static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
    }
  }
  return seconds;
}

}  // namespace

MachineWatch::MachineWatch() : load_(kNotMeasured), own_(own_cpu()) {
  (void)::getloadavg(&load_, 1);
  const CoreTimes times = core_times();
  steal_ = times.steal;
  busy_ = times.busy;
  all_ = times.all;
}

Extra MachineWatch::conditions() const {
  const CoreTimes now = core_times();
  const double all = now.all - all_;
  const double others = (now.busy - busy_) - (own_cpu() - own_);
  return {{"load_average", load_},
          {"steal_percent", 100 * ratio(now.steal - steal_, all)},
          {"other_cpu_percent", 100 * ratio(std::max(others, 0.0), all)}};
}

}  // namespace plchost::bench
