#pragma once

#include <string>

#include <control.h>

#include "api/cli/rows/histogram_plot.hpp"
#include "api/cli/rows/table.hpp"

namespace plchost {

/// Adds all numbers of a task's statistics to its row, with percentiles and histograms: for --json.
void add_statistics(Row& row, const plc_TaskStatistics& sample);

/// The same for people: a table of the quantities and a drawing of each histogram.
[[nodiscard]] std::string format_statistics(const plc_TaskStatistics& sample, PlotStyle style);

}  // namespace plchost
