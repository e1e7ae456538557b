#include "api/cli/rows/histogram_plot.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <span>
#include <sstream>

#include <gmock/gmock.h>

#include "api/cli/rows/statistics_rows.hpp"
#include "api/client/statistics_cache.hpp"
#include "api/dds/sequence.hpp"
#include "shm/base/duration_histogram.hpp"

namespace plchost {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;

// The bars last until the program ends.
plc_DurationHistogram of(std::vector<plc_HistogramBar> bars) {
  static std::deque<std::vector<plc_HistogramBar>> kept;
  plc_DurationHistogram histogram{};
  for (const auto& bar : bars) histogram.total += bar.count;
  dds::lend(histogram.bars, kept.emplace_back(std::move(bars)));
  return histogram;
}

/// As a terminal counts: UTF-8's continuation bytes have no width.
std::size_t width(std::string_view line) {
  return static_cast<std::size_t>(
      std::ranges::count_if(line, [](char c) { return (static_cast<unsigned char>(c) & 0xc0U) != 0x80U; }));
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> split;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) split.push_back(line);
  return split;
}

TEST(HistogramPlot, DrawsTheHighestBarToTheTopAndTheRarestAtAll) {
  const auto drawn = lines(plot(of({{1024, 1'000'000}, {2048, 500'000}, {8192, 1}}), {80, false}));
  ASSERT_EQ(drawn.size(), 10U) << "eight rows, the axis, its names";
  EXPECT_THAT(drawn[0], HasSubstr("|##"));
  EXPECT_THAT(drawn[0], HasSubstr("66.67%"));
  EXPECT_EQ(std::ranges::count(drawn[0], '#'), 2) << "two characters for each bar where there is room";
  EXPECT_EQ(std::ranges::count(drawn[4], '#'), 4) << "half as high";
  EXPECT_TRUE(drawn[7].ends_with("..")) << "one in a million";
}

TEST(HistogramPlot, NamesThePowersOfTenAndWhereItBegins) {
  const auto drawn = lines(plot(of({{288, 1}, {1 << 22, 1}}), {120, true}));
  for (const char* name : {"288ns", "1us", "10us", "100us", "1ms"})
    EXPECT_THAT(drawn.back(), HasSubstr(name));
  EXPECT_THAT(drawn.back(), Not(HasSubstr("10ms")));
}

TEST(HistogramPlot, FitsIntoAnyTerminal) {
  std::vector<plc_HistogramBar> all;
  constexpr HistogramShape kBars = HistogramShape::bars();
  for (std::size_t i = 0; i < kBars.bucket_count(); ++i) all.push_back({kBars.lower_edge(i).count(), i + 1});
  for (const std::size_t columns : {26U, 40U, 80U, 81U, 300U}) {
    for (const bool unicode : {false, true}) {
      for (const auto& text : {plot(of(all), {columns, unicode}), plot(of({{1, 1}}), {columns, unicode}),
                               plot_signed(of(all), of(all), {columns, unicode})}) {
        const auto drawn = lines(text);
        EXPECT_EQ(drawn.size(), 10U);
        for (std::size_t i = 0; i + 1 < drawn.size(); ++i) EXPECT_LE(width(drawn[i]), columns);
      }
    }
  }
}

TEST(HistogramPlot, UsesOnlyAsciiWhereItMust) {
  const auto report = of({{100, 3}, {200, 8}});
  const std::string plain = plot_signed(report, report, {60, false});
  EXPECT_TRUE(std::ranges::all_of(plain, [](char c) { return static_cast<unsigned char>(c) < 0x80; }));
  EXPECT_THAT(plot(report, {60, true}), HasSubstr("█"));
}

TEST(HistogramPlot, PutsNegativeDeviationsToTheLeftWithTheGreatestFirst) {
  const auto drawn = lines(plot_signed(of({{1024, 1}, {16'384, 8}}), of({{0, 4}}), {80, false}));
  const std::string& axis = drawn.back();
  EXPECT_LT(axis.find("-10us"), axis.find("-1us"));
  const std::string top = drawn[0].substr(drawn[0].find('|') + 1);
  EXPECT_TRUE(top.starts_with("#")) << top;
}

TEST(HistogramPlot, SaysThatNothingWasRecorded) {
  EXPECT_EQ(plot({}, {}), "  nothing recorded\n");
  EXPECT_EQ(plot_signed({}, {}, {}), "  nothing recorded\n");
  EXPECT_THAT(plot_signed(of({{5, 1}}), {}, {}), Not(HasSubstr("nothing")));
}

TEST(HistogramPlot, SurvivesBarsThatCannotBe) {
  EXPECT_EQ(plot(of({{1000, 1}, {10, 1}}), {}), "  nothing recorded\n");
  (void)plot(of({{-5, 1}, {INT64_MAX, UINT64_MAX}}), {});
  (void)plot_signed(of({{10, 1}}), of({{9, 1}, {8, 1}}), {});
}

TEST(ShortDuration, HasThreeDigitsAndAUnit) {
  const std::array<std::pair<std::int64_t, const char*>, 6> cases{{{0, "0ns"},
                                                                   {980, "980ns"},
                                                                   {1'500, "1.50us"},
                                                                   {12'340, "12.3us"},
                                                                   {250'000'000, "250ms"},
                                                                   {7'000'000'000, "7.00s"}}};
  for (const auto& [ns, text] : cases) EXPECT_EQ(short_duration(ns), text);
}

TEST(StatisticsRows, GiveEveryNumberToPrograms) {
  plc_TaskStatistics sample{};
  sample.cycles = 12;
  sample.recorded = 7;
  sample.lost_consecutive_max = 3;
  sample.spin_ppm = 65'000;
  sample.latency = {1'000, 500, 9'000, 2'500};
  sample.latency_histogram = of({{960, 7}});
  std::ranges::copy(std::array{1'000, 2'000, 3'000, 4'000, 5'000}, sample.latency_histogram.percentiles_ns);
  sample.last_loss = {.lost = 2,
                      .release_unix_ns = 1'700'000'000'000'000'000,
                      .start_unix_ns = 1'700'000'000'000'001'500,
                      .end_unix_ns = 1'700'000'000'002'000'000};
  Row row;
  add_statistics(row, sample);
  EXPECT_EQ(row["last_loss_cycles"], 2);
  EXPECT_EQ(row["last_loss_release"], "2023-11-14T22:13:20.000Z");
  EXPECT_EQ(row["last_loss_start_us"], 1.5);
  EXPECT_EQ(row["last_loss_end_us"], 2'000.0);
  EXPECT_EQ(row["cycles"], 12);
  EXPECT_EQ(row["recorded"], 7);
  EXPECT_EQ(row["lost_consecutive_max"], 3);
  EXPECT_EQ(row["spin_share_percent"], 6.5);
  EXPECT_EQ(row["latency_min_us"], 0.5);
  EXPECT_EQ(row["latency_avg_us"], 2.5);
  EXPECT_EQ(row["latency_p99_9_us"], 4.0);
  EXPECT_EQ(row["latency_histogram"][0]["from_us"], 0.96);
  EXPECT_EQ(row["latency_histogram"][0]["below_us"], 1.024);
  EXPECT_EQ(row["latency_histogram"][0]["count"], 7);
  for (const char* field :
       {"exec_p50_us", "release_jitter_max_us", "release_jitter_p99_us", "release_jitter_histogram",
        "period_jitter_min_us", "period_jitter_negative_p99_us", "period_jitter_positive_histogram",
        "slots_last", "slots_max", "lost_events", "digits", "elapsed_s", "since_unix_s"}) {
    EXPECT_TRUE(row.contains(field)) << field;
  }
}

TEST(StatisticsRows, ShowPeopleJitterOnlyWhereThereIsSome) {
  plc_TaskStatistics sample{};
  sample.latency_histogram = of({{960, 7}});
  EXPECT_THAT(format_statistics(sample, {}), Not(HasSubstr("period jitter")));
  EXPECT_THAT(format_statistics(sample, {}), Not(HasSubstr("last_loss")));
  sample.last_loss.lost = 1;
  EXPECT_THAT(format_statistics(sample, {}), HasSubstr("last_loss_release"));
  sample.jitter_negative_histogram = of({{10, 1}});
  EXPECT_THAT(format_statistics(sample, {}), HasSubstr("period jitter"));
}

std::vector<std::string> fields_of(const plc_TaskStatistics& sample) {
  Row row;
  add_statistics(row, sample);
  std::vector<std::string> fields;
  for (const auto& [field, value] : row.items()) fields.push_back(field);
  return fields;
}

// Programs go by the names, and a table of comma-separated values by their order, too.
TEST(StatisticsRows, HaveTheFieldsOfEachHistogramBehindThoseOfItsSummary) {
  const std::vector<std::string> all = fields_of({});
  std::vector<std::string> quantities(std::ranges::find(all, "latency_last_us"), all.end());
  std::erase_if(quantities, [](const std::string& field) {
    return !field.ends_with("_max_us") && !field.ends_with("_p50_us") && !field.ends_with("_histogram");
  });
  EXPECT_THAT(quantities,
              ElementsAre("latency_max_us", "latency_p50_us", "latency_histogram", "exec_max_us",
                          "exec_p50_us", "exec_histogram", "release_jitter_max_us", "release_jitter_p50_us",
                          "release_jitter_histogram", "period_jitter_max_us", "period_jitter_negative_p50_us",
                          "period_jitter_negative_histogram", "period_jitter_positive_p50_us",
                          "period_jitter_positive_histogram"));
}

TEST(StatisticsRows, ShowPeopleEachQuantityAndADrawingOfEachShape) {
  plc_TaskStatistics sample{};
  sample.jitter_positive_histogram = sample.latency_histogram = of({{960, 7}});
  std::vector<std::string> titles;
  for (const std::string& line : lines(format_statistics(sample, {}))) {
    const std::size_t end = line.starts_with("  ") ? line.find("  ", 2) : line.find("  ");
    if (!line.empty() && line.find('|') == std::string::npos) titles.push_back(line.substr(0, end));
  }
  EXPECT_THAT(titles,
              IsSupersetOf({"latency", "execution", "release jitter", "period jitter", "  too short by",
                            "  too long by", "latency: planned release to start", "execution: start to end",
                            "period jitter: start to start, against the planned distance"}));
  EXPECT_THAT(titles, Not(Contains(HasSubstr("release jitter:")))) << "it is the latency, moved";
}

TEST(StatisticsReport, HoldsTheBarsOfItsSampleAndSharesThemWithItsCopies) {
  std::vector<plc_HistogramBar> lent{{1, 2}, {3, 4}};
  plc_TaskStatistics sample{};
  dds::lend(sample.latency_histogram.bars, lent);
  dds::lend(sample.jitter_positive_histogram.bars, std::span(lent).subspan(1));
  const auto copy = [&] { return StatisticsReport(StatisticsReport(sample)); }();
  lent.assign(2, {});
  const auto counts = [](const plc_DurationHistogram& histogram) {
    std::vector<std::uint64_t> all;
    for (const auto& bar : dds::parts_of(histogram.bars)) all.push_back(bar.count);
    return all;
  };
  EXPECT_THAT(counts(copy.sample().latency_histogram), ElementsAre(2U, 4U));
  EXPECT_THAT(counts(copy.sample().jitter_positive_histogram), ElementsAre(4U));
  EXPECT_THAT(counts(copy.sample().execution_histogram), IsEmpty());
}

}  // namespace
}  // namespace plchost
