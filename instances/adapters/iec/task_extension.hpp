#pragma once

#include <optional>
#include <string>

#include "instances/adapters/iec/source_place.hpp"
#include "schedulers/settings/task_options.hpp"

namespace plchost::iec {

/// The configuration of a task for which IEC 61131-3 has no words.
struct TaskExtension {
  std::string external_event;  ///< each post runs it, instead of INTERVAL and SINGLE; empty: none
  std::optional<TaskOptions> options;
  SourcePlace place;  ///< of its table in the task file; line 0: it has none
};

}  // namespace plchost::iec
