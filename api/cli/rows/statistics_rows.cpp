#include "api/cli/rows/statistics_rows.hpp"

#include <array>
#include <cstdint>
#include <string_view>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/status_rows.hpp"
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

void add_histogram(Row& row, std::string_view name, const HistogramReport& histogram) {
  for (std::size_t i = 0; i < kPercentiles.size(); ++i) {
    row[fmt::format("{}_{}_us", name, kPercentiles.at(i))] = to_us(histogram.percentiles_ns.at(i));
  }
  constexpr HistogramShape kBars = HistogramShape::bars();
  Row bars = Row::array();
  for (const auto& bar : histogram.bars) {
    const std::size_t index = kBars.index_of(Duration(bar.lower_ns));
    bars.push_back(Row{{"from_us", to_us(bar.lower_ns)},
                       {"below_us", to_us(kBars.lower_edge(index + 1).count())},
                       {"count", bar.count}});
  }
  row[fmt::format("{}_histogram", name)] = std::move(bars);
}

std::string local_time(std::int64_t unix_ns) {
  return fmt::format("{:%F %T}", fmt::localtime(static_cast<std::time_t>(unix_ns / 1'000'000'000)));
}

Row table_row(std::string_view name, const plc_DurationSummary* summary, const HistogramReport* histogram) {
  Row row{{"quantity", name}};
  if (summary != nullptr) add_summary(row, "of", *summary);
  for (std::size_t i = 0; histogram != nullptr && i < kPercentiles.size(); ++i) {
    row[kPercentiles.at(i)] = to_us(histogram->percentiles_ns.at(i));
  }
  return row;
}

std::string format_quantities(const StatisticsReport& report) {
  const plc_TaskStatistics& numbers = report.numbers;
  std::vector<Row> rows{table_row("latency", &numbers.latency, &report.latency),
                        table_row("execution", &numbers.execution, &report.execution),
                        table_row("release jitter", &numbers.release_jitter, &report.release_jitter)};
  if (report.jitter_negative.total + report.jitter_positive.total > 0) {
    rows.push_back(table_row("period jitter", &numbers.period_jitter, nullptr));
    rows.push_back(table_row("  too short by", nullptr, &report.jitter_negative));
    rows.push_back(table_row("  too long by", nullptr, &report.jitter_positive));
  }
  const std::vector<Column> columns{
      {"quantity", "(us)"},    {"of_last_us", "LAST", 3}, {"of_min_us", "MIN", 3}, {"of_avg_us", "AVG", 3},
      {"of_max_us", "MAX", 3}, {"p50", "P50", 3},         {"p90", "P90", 3},       {"p99", "P99", 3},
      {"p99_9", "P99.9", 3},   {"p99_99", "P99.99", 3}};
  return format_table(rows, columns);
}

}  // namespace

void add_statistics(Row& row, const StatisticsReport& report) {
  const plc_TaskStatistics& numbers = report.numbers;
  row.update(to_row(numbers));
  add_summary(row, "latency", numbers.latency);
  add_histogram(row, "latency", report.latency);
  add_summary(row, "exec", numbers.execution);
  add_histogram(row, "exec", report.execution);
  add_summary(row, "release_jitter", numbers.release_jitter);
  add_histogram(row, "release_jitter", report.release_jitter);
  add_summary(row, "period_jitter", numbers.period_jitter);
  add_histogram(row, "period_jitter_negative", report.jitter_negative);
  add_histogram(row, "period_jitter_positive", report.jitter_positive);
}

std::string format_statistics(const StatisticsReport& report, PlotStyle style) {
  const plc_TaskStatistics& numbers = report.numbers;
  Row counters = to_row(numbers);
  counters.erase("since_unix_s");
  if (numbers.last_loss.lost == 0) {
    for (const char* field :
         {"last_loss_cycles", "last_loss_release", "last_loss_start_us", "last_loss_end_us"})
      counters.erase(field);
  }
  std::string text = fmt::format("\n{:<20}  {}\n", "since", local_time(numbers.since_unix_ns));
  text += format_fields(counters);
  text += "\n" + format_quantities(report);
  text += "\nlatency: planned release to start\n" + plot(report.latency, style);
  text += "\nexecution: start to end\n" + plot(report.execution, style);
  if (report.jitter_negative.total + report.jitter_positive.total > 0) {
    text += "\nperiod jitter: start to start, against the planned distance\n" +
            plot_signed(report.jitter_negative, report.jitter_positive, style);
  }
  return text;
}

}  // namespace plchost
