#pragma once

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::iec {

/// Reads a task file (TOML) into the extensions of the tasks that it names: [task.NAME], and
/// [resource.NAME.task.NAME] where several resources have a task of that name. Of the configuration it reads
/// the places of locations. All problems are told.
/// Any text, hostile ones included: bounded depth.
[[nodiscard]] SourceProblems read_task_file(const Source& file, Configuration& configuration);

}  // namespace plchost::iec
