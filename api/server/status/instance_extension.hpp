#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "control.h"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

/// An instance's status beyond the fields of plc_InstanceStatus: entries of its ext, in this order. At most
/// 15; a feature that is not in use has none.
///
///   tick_source    where the periodic tick comes from
///   tick_fallback  why that is not the source that the settings ask for
///   idle_states    what of the processor's idle states is held off, or why not
///   clock_...      the distributed clock as the cyclic task of the highest priority sees it: name of its
///                  record, state, in sync, offset and drift (to the nearest hundred), corrections, pairs
[[nodiscard]] std::vector<plc_KeyValue> extension_of(const InstanceRuntime& runtime);
/// InstanceStatus.problem: the manager's text, and the one that only the process knows. `runtime`: of any
/// process of it, or null.
[[nodiscard]] std::string problem_of_instance(const InstanceStatus& status, const InstanceRuntime* runtime);

/// One more entry, see dds::kTransitionsEntry.
[[nodiscard]] plc_KeyValue transitions_entry(std::uint64_t last);

}  // namespace plchost
