#include "api/cli/rows/histogram_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "api/dds/sequence.hpp"
#include "shm/base/duration_histogram.hpp"

namespace plchost {

namespace {

constexpr HistogramShape kPlotBars = HistogramShape::bars();
constexpr std::size_t kHeight = 8;
constexpr std::size_t kMargin = 10;  // of the shares
constexpr std::size_t kLeastPlotWidth = 16;
constexpr std::size_t kWidestColumn = 2;
constexpr std::array<std::string_view, 9> kEighths{" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};

/// A column of the drawing: bars [begin, end) of the logarithmic axis.
struct PlotColumn {
  std::uint64_t count = 0;
  std::string label;
};

/// The part of the axis that has bars, by their index.
struct Range {
  std::size_t begin = 0;
  std::size_t end = 0;
  [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
};

Range range_of(const plc_DurationHistogram& histogram) {
  const auto bars = dds::parts_of(histogram.bars);
  if (bars.empty()) return {};
  return {kPlotBars.index_of(Duration(bars.front().lower_ns)),
          kPlotBars.index_of(Duration(bars.back().lower_ns)) + 1};
}

/// The power of ten in bars [begin, end); 0: none.
std::int64_t decade_in(std::size_t begin, std::size_t end) {
  constexpr std::int64_t kLast = 1'000'000'000;
  for (std::int64_t decade = 1; decade <= kLast; decade *= 10) {
    const std::size_t index = kPlotBars.index_of(Duration(decade));
    if (index >= begin && index < end) return decade;
  }
  return 0;
}

std::string decade_name(std::int64_t decade) {
  constexpr std::array<std::string_view, 4> kUnits{"ns", "us", "ms", "s"};
  std::size_t unit = 0;
  for (; decade >= 1000; decade /= 1000) ++unit;
  return fmt::format("{}{}", decade, kUnits[unit]);
}

std::vector<PlotColumn> plot_columns(const plc_DurationHistogram& histogram, Range range,
                                     std::size_t bars_each) {
  std::vector<PlotColumn> columns((range.size() + bars_each - 1) / bars_each);
  for (const auto& bar : dds::parts_of(histogram.bars)) {
    const std::size_t index = kPlotBars.index_of(Duration(bar.lower_ns));
    // Bars from the network may be in any order.
    if (index >= range.begin && index < range.end)
      columns[(index - range.begin) / bars_each].count += bar.count;
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::size_t begin = range.begin + i * bars_each;
    if (const auto decade = decade_in(begin, begin + bars_each); decade != 0) {
      columns[i].label = decade_name(decade);
    }
  }
  if (!columns.empty() && columns.front().label.empty()) {
    columns.front().label = short_duration(kPlotBars.lower_edge(range.begin).count());
  }
  return columns;
}

/// One line of bars: the part of each that reaches into the row, 0 (the lowest) to kHeight - 1.
std::string row_of(const std::vector<PlotColumn>& columns, std::size_t row, std::uint64_t highest,
                   std::size_t column_width, bool unicode) {
  constexpr std::size_t kSteps = kEighths.size() - 1;
  std::string line;
  for (const PlotColumn& column : columns) {
    const double share = static_cast<double>(column.count) / static_cast<double>(highest);
    auto level = static_cast<std::size_t>(std::lround(share * static_cast<double>(kHeight * kSteps)));
    if (column.count > 0) level = std::max<std::size_t>(level, 1);  // the rare ones are what one looks for
    const std::size_t step = std::min(level - std::min(level, row * kSteps), kSteps);
    const std::string_view plain = step == 0 ? " " : step * 2 >= kSteps ? "#" : ".";
    for (std::size_t i = 0; i < column_width; ++i) line += unicode ? kEighths[step] : plain;
  }
  return line;
}

/// The names below the axis, as many as do not run into each other.
std::string labels_of(const std::vector<PlotColumn>& columns, std::size_t column_width) {
  std::string line;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::size_t at = i * column_width;
    if (columns[i].label.empty() || (at < line.size() + 1 && !line.empty())) continue;
    line.resize(at, ' ');
    line += columns[i].label;
  }
  return line;
}

std::string draw(const std::vector<PlotColumn>& columns, std::uint64_t total, PlotStyle style) {
  const std::uint64_t highest = std::ranges::max(columns, {}, &PlotColumn::count).count;
  const std::size_t room = std::max(style.width, kMargin + kLeastPlotWidth) - kMargin;
  const std::size_t column_width = std::clamp<std::size_t>(room / columns.size(), 1, kWidestColumn);
  const std::string_view side = style.unicode ? "│" : "|";
  std::string text;
  for (std::size_t row = kHeight; row-- > 0;) {
    const double share = 100.0 * static_cast<double>(highest) / static_cast<double>(total) *
                         static_cast<double>(row + 1) / static_cast<double>(kHeight);
    const std::string name = (row + 1) % 4 == 0 ? fmt::format("{:>7.2f}%", share) : std::string(8, ' ');
    text += fmt::format("{} {}{}\n", name, side, row_of(columns, row, highest, column_width, style.unicode));
  }
  std::string axis;
  for (std::size_t i = 0; i < columns.size() * column_width; ++i) axis += style.unicode ? "─" : "-";
  text += fmt::format("{:>9}{}{}\n", "", style.unicode ? "└" : "+", axis);
  return text + fmt::format("{:>10}{}\n", "", labels_of(columns, column_width));
}

/// How many bars go into one column, so that `bars` of them fit.
std::size_t bars_each(std::size_t bars, PlotStyle style) {
  const std::size_t room = std::max(style.width, kMargin + kLeastPlotWidth) - kMargin - 2;
  return (bars + room - 1) / room;
}

}  // namespace

std::string short_duration(std::int64_t nanoseconds) {
  constexpr std::array<std::string_view, 4> kUnits{"ns", "us", "ms", "s"};
  auto value = static_cast<double>(nanoseconds);
  std::size_t unit = 0;
  for (; std::abs(value) >= 1000 && unit + 1 < kUnits.size(); value /= 1000) ++unit;
  const int decimals = unit == 0 || std::abs(value) >= 100 ? 0 : std::abs(value) >= 10 ? 1 : 2;
  return fmt::format("{:.{}f}{}", value, decimals, kUnits[unit]);
}

std::string plot(const plc_DurationHistogram& histogram, PlotStyle style) {
  const Range range = range_of(histogram);
  if (range.size() == 0 || range.end < range.begin || histogram.total == 0) return "  nothing recorded\n";
  return draw(plot_columns(histogram, range, bars_each(range.size(), style)), histogram.total, style);
}

std::string plot_signed(const plc_DurationHistogram& negative, const plc_DurationHistogram& positive,
                        PlotStyle style) {
  const Range left = range_of(negative);
  const Range right = range_of(positive);
  const std::uint64_t total = negative.total + positive.total;
  if (left.end < left.begin || right.end < right.begin || left.size() + right.size() == 0 || total == 0) {
    return "  nothing recorded\n";
  }
  // One gap for zero, and the same scale on both sides of it.
  const std::size_t each = bars_each(left.size() + right.size() + 2, style);
  std::vector<PlotColumn> columns = plot_columns(negative, left, each);
  std::ranges::reverse(columns);
  for (PlotColumn& column : columns) {
    if (!column.label.empty()) column.label = "-" + column.label;
  }
  const std::vector<PlotColumn> rest = plot_columns(positive, right, each);
  columns.insert(columns.end(), rest.begin(), rest.end());
  return draw(columns, total, style);
}

}  // namespace plchost
