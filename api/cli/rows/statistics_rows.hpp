#pragma once

#include <string>

#include "api/cli/rows/histogram_plot.hpp"
#include "api/cli/rows/table.hpp"
#include "api/client/statistics_cache.hpp"

namespace plchost {

/// Adds all numbers of a task's statistics to its row, with percentiles and histograms: for --json.
void add_statistics(Row& row, const StatisticsReport& report);

/// The same for people: a table of the quantities and a drawing of each histogram.
[[nodiscard]] std::string format_statistics(const StatisticsReport& report, PlotStyle style);

}  // namespace plchost
