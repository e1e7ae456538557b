#include "api/cli/rows/statistics_rows.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <status_fields.hpp>

#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/dds/sequence.hpp"
#include "shm/base/duration_histogram.hpp"

namespace plchost {

namespace {

constexpr std::array kPercentiles{"p50", "p90", "p99", "p99_9", "p99_99"};

void add_summary(Row& row, std::string_view name, const plc_DurationSummary& summary) {
  row[fmt::format("{}_last_us", name)] = to_us(summary.last_ns);
  row[fmt::format("{}_min_us", name)] = to_us(summary.min_ns);
  row[fmt::format("{}_avg_us", name)] = to_us(summary.average_ns);
  row[fmt::format("{}_max_us", name)] = to_us(summary.max_ns);
}

void add_histogram(Row& row, std::string_view name, const plc_DurationHistogram& histogram) {
  for (std::size_t i = 0; i < kPercentiles.size(); ++i) {
    row[fmt::format("{}_{}_us", name, kPercentiles.at(i))] = to_us(histogram.percentiles_ns[i]);
  }
  constexpr HistogramShape kBars = HistogramShape::bars();
  Row bars = Row::array();
  for (const auto& bar : dds::parts_of(histogram.bars)) {
    const std::size_t index = kBars.index_of(Duration(bar.lower_ns));
    bars.push_back(Row{{"from_us", to_us(bar.lower_ns)},
                       {"below_us", to_us(kBars.lower_edge(index + 1).count())},
                       {"count", bar.count}});
  }
  row[fmt::format("{}_histogram", name)] = std::move(bars);
}

/// One quantity of the statistics: its summary, its histogram, or both.
struct Quantity {
  std::string_view name;  ///< "execution"
  std::string_view row;   ///< the fields of a row begin with it: "exec"
  std::string_view text;
  const plc_DurationSummary* summary = nullptr;
  const plc_DurationHistogram* histogram = nullptr;
};

// In the order of the row. A histogram belongs to the summary of its name, which stands before it.
std::vector<Quantity> quantities_of(const plc_TaskStatistics& sample) {
  std::vector<Quantity> quantities;
  const auto of = [&](std::string_view name, std::string_view row, std::string_view text) -> Quantity& {
    if (!quantities.empty() && quantities.back().name == name) return quantities.back();
    return quantities.emplace_back(name, row, text);
  };
  dds::visit_parts(sample, [&](const dds::PartInfo& info, const auto& part) {
    if constexpr (requires { part.bars; }) {
      constexpr std::size_t kEnd = std::string_view("_histogram").size();
      of(info.name.substr(0, info.name.size() - kEnd), info.row.substr(0, info.row.size() - kEnd), info.text)
          .histogram = &part;
    } else {
      of(info.name, info.row, info.text).summary = &part;
    }
  });
  return quantities;
}

std::string local_time(std::int64_t unix_ns) {
  return fmt::format("{:%F %T}", fmt::localtime(static_cast<std::time_t>(unix_ns / 1'000'000'000)));
}

// The period jitter has a sign: the histograms of its halves are one drawing. Without records it is not
// shown.
constexpr std::string_view kPeriodJitter = "period_jitter";

bool has_period_jitter(const plc_TaskStatistics& sample) {
  return sample.jitter_negative_histogram.total + sample.jitter_positive_histogram.total > 0;
}

std::string title_of(const plc_TaskStatistics& sample, const Quantity& quantity) {
  if (quantity.histogram == &sample.jitter_negative_histogram) return "  too short by";
  if (quantity.histogram == &sample.jitter_positive_histogram) return "  too long by";
  std::string title(quantity.name);
  std::ranges::replace(title, '_', ' ');
  return title;
}

std::string format_quantities(const plc_TaskStatistics& sample) {
  std::vector<Row> rows;
  for (const Quantity& quantity : quantities_of(sample)) {
    if (quantity.row.starts_with(kPeriodJitter) && !has_period_jitter(sample)) continue;
    Row& row = rows.emplace_back(Row{{"quantity", title_of(sample, quantity)}});
    if (quantity.summary != nullptr) add_summary(row, "of", *quantity.summary);
    for (std::size_t i = 0; quantity.histogram != nullptr && i < kPercentiles.size(); ++i) {
      row[kPercentiles.at(i)] = to_us(quantity.histogram->percentiles_ns[i]);
    }
  }
  const std::vector<Column> columns{
      {"quantity", "(us)"},    {"of_last_us", "LAST", 3}, {"of_min_us", "MIN", 3}, {"of_avg_us", "AVG", 3},
      {"of_max_us", "MAX", 3}, {"p50", "P50", 3},         {"p90", "P90", 3},       {"p99", "P99", 3},
      {"p99_9", "P99.9", 3},   {"p99_99", "P99.99", 3}};
  return format_table(rows, columns);
}

}  // namespace

void add_statistics(Row& row, const plc_TaskStatistics& sample) {
  row.update(to_row(sample));
  for (const Quantity& quantity : quantities_of(sample)) {
    if (quantity.summary != nullptr) add_summary(row, quantity.row, *quantity.summary);
    if (quantity.histogram != nullptr) add_histogram(row, quantity.row, *quantity.histogram);
  }
}

std::string format_statistics(const plc_TaskStatistics& sample, PlotStyle style) {
  Row counters = to_row(sample);
  counters.erase("since_unix_s");
  if (sample.last_loss.lost == 0) {
    for (const char* field :
         {"last_loss_cycles", "last_loss_release", "last_loss_start_us", "last_loss_end_us"})
      counters.erase(field);
  }
  std::string text = fmt::format("\n{:<20}  {}\n", "since", local_time(sample.since_unix_ns));
  text += format_fields(counters);
  text += "\n" + format_quantities(sample);
  for (const Quantity& quantity : quantities_of(sample)) {
    // The release jitter is the latency, moved.
    if (quantity.histogram == nullptr || quantity.histogram == &sample.release_jitter_histogram ||
        quantity.row.starts_with(kPeriodJitter))
      continue;
    text += fmt::format("\n{}: {}\n{}", title_of(sample, quantity), quantity.text,
                        plot(*quantity.histogram, style));
  }
  if (has_period_jitter(sample)) {
    text += "\nperiod jitter: start to start, against the planned distance\n" +
            plot_signed(sample.jitter_negative_histogram, sample.jitter_positive_histogram, style);
  }
  return text;
}

}  // namespace plchost
