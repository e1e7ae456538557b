#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include <control.h>

#include "api/server/status/status_table.hpp"
#include "api/server/status/task_watch.hpp"
#include "shm/base/time.hpp"
#include "shm/files/file_version.hpp"
#include "shm/pages/exception_history.hpp"
#include "shm/pages/host_page.hpp"

namespace plchost {

/// Shows the last exception of each instance, from the file in which the instance keeps them. Control loop
/// only.
class ExceptionWatch {
 public:
  /// A file is looked at so often, and at once when its instance has changed; read when it is another one.
  static constexpr Duration kPeriod = std::chrono::milliseconds(100);

  ExceptionWatch(std::string run_directory, StatusTable<plc_ExceptionStatus>& table)
      : run_directory_(std::move(run_directory)), table_(&table) {}

  /// A round: follow() for each instance that the manager has; end_round() disposes what is left of others
  /// and writes what is news. All return true if something changed. `tasks` follows the same instance
  /// already.
  void begin_round() { table_->begin_round(); }
  bool follow(const InstanceStatus& instance, const TaskWatch& tasks, TimePoint now);
  bool end_round();

 private:
  struct Watched {
    std::int32_t pid = 0;
    InstanceState state = InstanceState::offline;
    TimePoint next_look;
    FileVersion version;
    plc_ExceptionStatus sample{};
    bool followed = true;  // in this round
  };
  void look(Watched& watched, const std::string& name);
  static void show(Watched& watched, const ExceptionHistory& history);

  std::string run_directory_;
  StatusTable<plc_ExceptionStatus>* table_;
  std::map<std::string, Watched> instances_;
};

}  // namespace plchost
