#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <control.h>

namespace plchost {

/// The room of a drawing, and its characters.
struct PlotStyle {
  std::size_t width = 80;  ///< of the terminal, in characters
  bool unicode = true;     ///< bars in eighths of a character; else '#' and '.'
};

/// A few lines: bars over a logarithmic axis of durations, shares of all records to the left. Of nothing
/// recorded: one line that says so.
[[nodiscard]] std::string plot(const plc_DurationHistogram& histogram, PlotStyle style);
/// The same of deviations with a sign: the negative ones to the left of zero, as magnitudes in their own
/// histogram.
[[nodiscard]] std::string plot_signed(const plc_DurationHistogram& negative,
                                      const plc_DurationHistogram& positive, PlotStyle style);

/// "980ns", "1.50us", "12.0ms", "3.00s".
[[nodiscard]] std::string short_duration(std::int64_t nanoseconds);

}  // namespace plchost
