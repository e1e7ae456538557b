#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <control.h>

#include "api/control/application_versions.hpp"
#include "api/server/status/status_table.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Shows the applications that are kept for each instance, as the folder of the manager's helper says.
/// Control loop only.
class ApplicationWatch {
 public:
  /// How often it is looked whether a folder has changed.
  static constexpr Duration kPeriod = std::chrono::milliseconds(500);

  ApplicationWatch() = default;
  /// `folder`: of all instances; empty: there is none.
  ApplicationWatch(std::string folder, StatusTable<plc_ApplicationStatus>& table)
      : folder_(std::move(folder)), table_(&table) {}

  /// Looks at those of all instances, if it is time for that. True: there is news.
  bool look(const std::vector<std::string>& instances, TimePoint now);
  /// Looks at one, whatever the time.
  bool look_at(const std::string& instance);

 private:
  struct Known {
    std::int64_t changed_ns = 0;  // the folder's time when it was read
    bool settled = false;         // nothing can have changed since without another time
    std::vector<plc_ApplicationStatus> samples;
  };
  void read(const std::string& instance, Known& known) const;
  bool show();

  std::string folder_;
  StatusTable<plc_ApplicationStatus>* table_ = nullptr;
  std::map<std::string, Known> known_;
  TimePoint next_;
};

}  // namespace plchost
