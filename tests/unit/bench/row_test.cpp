#include "tests/bench/row.hpp"

#include <cmath>
#include <cstdlib>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/bench/apart.hpp"
#include "tests/bench/plot.hpp"
#include "tests/support/text_between.hpp"

namespace plchost::bench {
namespace {

Samples one_to(int last) {
  Samples samples;
  for (int i = last; i >= 1; --i) samples.push(std::chrono::microseconds(i));
  return samples;
}

TEST(Summary, GivesTheValueThatTheShareOfSamplesIsBelow) {
  const Summary sut = summarise(one_to(1000));
  EXPECT_EQ(sut.p50, 501);
  EXPECT_EQ(sut.p99, 991);
  EXPECT_EQ(sut.p999, 1000);
  EXPECT_EQ(sut.max, 1000);
}

TEST(Samples, ThatDoNotFitAreCountedAndTheGreatestIsTheMaximum) {
  Samples sut(10);
  while (sut.size() < sut.values().capacity()) sut.add(std::chrono::microseconds(1));
  EXPECT_EQ(sut.dropped(), 0U);
  EXPECT_EQ(summarise(sut).max, 1);
  const std::size_t fitted = sut.size();
  sut.add(std::chrono::microseconds(7));
  sut.add(std::chrono::microseconds(3));
  EXPECT_EQ(sut.size(), fitted);
  EXPECT_EQ(sut.dropped(), 2U);
  EXPECT_EQ(summarise(sut).max, 7);
  Samples all;
  all.append(sut);
  all.append(one_to(5));
  EXPECT_EQ(all.dropped(), 2U);
  EXPECT_EQ(summarise(all).max, 7);
  const auto json = nlohmann::json::parse(to_json({{.name = "part/who", .ours = all}}));
  EXPECT_EQ(json[0]["dropped_samples"], 2);
  EXPECT_EQ(json[0]["floor_dropped_samples"], 0);
}

TEST(LostCycles, HaveABoundOnlyBesideAFloorThatLosesFew) {
  const Target beside_few = lost_cycles_target("F", 1100, 500);
  EXPECT_EQ(beside_few.text, "lost cycles at most twice those of F, and 100 in a million");
  EXPECT_TRUE(beside_few.met());
  EXPECT_FALSE(lost_cycles_target("F", 1101, 500).met());
  EXPECT_EQ(lost_cycles_target("F", 0, 1000).bound, 2100);
  EXPECT_FALSE(lost_cycles_target("F", 0, 1001).decided()) << "the bound would follow the noise";
}

TEST(Summary, HasNoPercentileThatNoSampleLiesAbove) {
  EXPECT_TRUE(std::isnan(summarise(Samples()).max));
  EXPECT_EQ(summarise(one_to(1)).p50, 1) << "the mean of the one slice of a round";
  const Summary few = summarise(one_to(20));
  EXPECT_EQ(few.p50, 11);
  EXPECT_EQ(few.p90, 19);
  EXPECT_TRUE(std::isnan(few.p99));
  EXPECT_EQ(few.max, 20);
  EXPECT_FALSE(std::isnan(summarise(one_to(100)).p99));
  EXPECT_TRUE(std::isnan(summarise(one_to(999)).p999));
}

TEST(Summary, DecidesByNoPercentileThatFewSamplesLieAbove) {
  EXPECT_TRUE(std::isnan(decisive_p999(one_to(19'499))));
  EXPECT_EQ(decisive_p999(one_to(20'000)), 19'981);
}

TEST(Ratio, ToAFloorThatIsNoneIsNone) {
  EXPECT_TRUE(std::isnan(ratio(3, 0)));
  EXPECT_TRUE(std::isnan(ratio(3, kNotMeasured)));
  EXPECT_TRUE(std::isnan(ratio_of_times(0.1, 0.001))) << "a nanosecond is one unit of the clock";
  EXPECT_EQ(ratio_of_times(3, 2), 1.5);
}

TEST(Target, IsMetBelowItsBoundAndAtItOnlyIfSaid) {
  EXPECT_TRUE((Target{"", "us", 1, 2}.met()));
  EXPECT_FALSE((Target{"", "us", 2, 2}.met()));
  EXPECT_TRUE((Target{"", "us", 2, 2, true}.met()));
  EXPECT_FALSE((Target{"", "us", 3, 2, true}.met()));
}

TEST(Target, IsNeitherMetNorMissedByWhatIsNoNumber) {
  for (const Target& sut :
       {Target{"", "us", kNotMeasured, 2, true}, Target{"", "us", 1, kNotMeasured, true}}) {
    EXPECT_FALSE(sut.met());
    EXPECT_FALSE(sut.decided());
    EXPECT_EQ(verdict_of({.name = "part", .targets = {sut}}, 0).text(), "not measured");
  }
}

Row round_of(double measured, int samples) {
  return {.name = "part/who",
          .sample = "a cycle",
          .ours = one_to(samples),
          .floor = one_to(samples / 2),
          .extra = {{"lost", measured}},
          .targets = {{"below 10", "us", measured, 10}}};
}

std::vector<Row> rounds(const std::vector<double>& measured) {
  std::vector<Row> all;
  for (const double one : measured) add_round(all, {round_of(one, 10)});
  return all;
}

TEST(Rounds, ThatDecideNothingHaveNoShareInTheFiguresOfATarget) {
  std::vector<Row> sut;
  for (const auto& [measured, bound] :
       {std::pair(kNotMeasured, 0.0), std::pair(3.0, 5.5), std::pair(kNotMeasured, 0.0)})
    add_round(sut, {{.name = "part/who", .targets = {{"lost cycles", "cycles", measured, bound}}}});
  EXPECT_EQ(sut[0].targets[0].measured, 3);
  EXPECT_EQ(sut[0].targets[0].bound, 5.5);
  EXPECT_EQ(verdict_of(sut[0], 0).text(), "met");
}

TEST(Rounds, AreOneRowWithAllSamplesAndTheMedianOfTheRest) {
  std::vector<Row> sut;
  add_round(sut, {round_of(3, 1000), {.name = "part/other"}});
  add_round(sut, {{.name = "part/other"}, round_of(9, 1000)});
  add_round(sut, {round_of(4, 1000)});
  ASSERT_EQ(sut.size(), 2U);
  EXPECT_EQ(sut[0].ours.size(), 3000U);
  EXPECT_EQ(sut[0].floor.size(), 1500U);
  EXPECT_EQ(sut[0].extra[0].second, 4);
  EXPECT_EQ(sut[0].targets[0].measured, 4);
  EXPECT_EQ(sut[0].rounds.size(), 3U);
  EXPECT_EQ(sut[0].rounds[1].targets[0].measured, 9);
  EXPECT_EQ(sut[1].rounds.size(), 2U);
}

TEST(Rounds, OfAnotherConditionAreAnotherRow) {
  std::vector<Row> sut;
  add_round(sut, {{.name = "part/who"}});
  add_round(sut, {{.name = "part/who", .condition = "stress"}});
  EXPECT_EQ(sut.size(), 2U);
}

TEST(Rounds, MakeTheVerdict) {
  EXPECT_EQ(verdict_of(rounds({1, 2, 3})[0], 0).text(), "met");
  EXPECT_EQ(verdict_of(rounds({11, 12, 13})[0], 0).text(), "not met");
  EXPECT_EQ(verdict_of(rounds({1, 12, 3})[0], 0).text(), "met in 2 of 3 rounds");
  EXPECT_EQ(verdict_of(rounds({1, kNotMeasured, 3})[0], 0).text(), "met");
  EXPECT_EQ(verdict_of(rounds({kNotMeasured, kNotMeasured})[0], 0).text(), "not measured");
}

TEST(Rounds, WhoseBoundsLieFarApartDecideOnlyWhatTheyAgreeOn) {
  const auto verdict = [](const std::vector<std::pair<double, double>>& measured_and_bound) {
    std::vector<Row> all;
    for (const auto& [measured, bound] : measured_and_bound)
      add_round(all, {{.name = "part/who", .targets = {{"below F", "us", measured, bound}}}});
    return verdict_of(all[0], 0).text();
  };
  EXPECT_EQ(verdict({{11, 10}, {14, 15}}), "met in 1 of 2 rounds");
  EXPECT_EQ(verdict({{11, 10}, {14, 16}}), "not measured");
  EXPECT_EQ(verdict({{9, 10}, {30, 40}}), "met");
  EXPECT_EQ(verdict({{11, 10}, {50, 40}}), "not met");
  EXPECT_EQ(verdict({{11, 10}, {14, 15}, {90, kNotMeasured}}), "met in 1 of 2 rounds");
}

TEST(Rounds, FurtherApartThanTheBoundDecideNothingWhereItMustBeSteady) {
  const auto verdict = [](const std::vector<double>& measured) {
    std::vector<Row> all;
    for (const double one : measured) {
      Row row = round_of(one, 10);
      row.targets[0].only_steady = true;
      add_round(all, {std::move(row)});
    }
    return verdict_of(all[0], 0).text();
  };
  EXPECT_EQ(verdict({-4, 1, 5}), "met");
  EXPECT_EQ(verdict({-6, 1, 5}), "not measured");
  EXPECT_EQ(verdict({8, 12, kNotMeasured}), "met in 1 of 2 rounds");
  EXPECT_EQ(verdict({12}), "not met");
  EXPECT_EQ(verdict({kNotMeasured}), "not measured");
}

TEST(Json, IsOneArrayWithARowForEach) {
  auto rows = rounds({1, 12, 3});
  rows[0].conditions = {{"load_average", 1.5}, {"load_average", 2.5}};
  rows.push_back({.name = "part/other"});
  const auto json = nlohmann::json::parse(to_json(rows));
  ASSERT_TRUE(json.is_array());
  ASSERT_EQ(json.size(), 2U);
  const auto& sut = json[0];
  EXPECT_EQ(sut["name"], "part/who");
  EXPECT_EQ(sut["sample"], "a cycle");
  EXPECT_EQ(sut["p50_us"], 6);
  EXPECT_EQ(sut["floor_p50_us"], 3);
  EXPECT_EQ(sut["ratio_p50"], 2);
  EXPECT_EQ(sut["samples"], 30);
  EXPECT_EQ(sut["floor_samples"], 15);
  EXPECT_EQ(sut["rounds"], 3);
  EXPECT_EQ(sut["p50_us_rounds"], nlohmann::json::array({6, 6, 6}));
  EXPECT_EQ(sut["extra"]["lost"], 3);
  EXPECT_EQ(sut["extra_rounds"]["lost"], nlohmann::json::array({1, 12, 3}));
  EXPECT_EQ(sut["targets"][0]["unit"], "us");
  EXPECT_EQ(sut["targets"][0]["measured_rounds"], nlohmann::json::array({1, 12, 3}));
  EXPECT_EQ(sut["targets"][0]["verdict"], "met in 2 of 3 rounds");
  EXPECT_EQ(sut["conditions"]["load_average"], nlohmann::json::array({1.5, 2.5}));
  EXPECT_FALSE(json[1].contains("targets"));
  EXPECT_TRUE(nlohmann::json::parse(to_json({})).empty());
}

TEST(Json, HasTheRevisionOfTheSources) {
  const auto revision = [] {
    return nlohmann::json::parse(
        to_json({{.name = "part/who", .ours = one_to(10)}}))[0]["conditions"]["revision"];
  };
  ::setenv("PLCHOST_REVISION", "1234abcd-dirty", 1);
  EXPECT_EQ(revision(), "1234abcd-dirty");
  ::setenv("PLCHOST_REVISION", "", 1);
  EXPECT_EQ(revision(), "unknown");
  ::unsetenv("PLCHOST_REVISION");
  EXPECT_EQ(revision(), "unknown");
}

TEST(Json, HasNoFigureWhereNoneWasMeasured) {
  const auto json = nlohmann::json::parse(to_json({{.name = "part/who", .ours = one_to(10)}}));
  const auto& sut = json[0];
  EXPECT_EQ(sut["floor_samples"], 0);
  for (const char* const key : {"floor_p50_us", "ratio_p50", "p99_us", "p999_us", "ratio_p999"})
    EXPECT_TRUE(sut[key].is_null()) << key;
  EXPECT_EQ(sut["p50_us"], 6);
}

TEST(Table, SaysPlainlyWhatIsNotMet) {
  const std::string sut = to_table(rounds({11, 12, 13}));
  EXPECT_NE(sut.find("not met: below 10: 12.000 us (11.000..13.000), bound 10.000"), std::string::npos)
      << sut;
}

TEST(Table, SaysWhatWasNotMeasured) {
  const std::string sut = to_table({{.name = "part/who", .ours = one_to(10)}});
  EXPECT_EQ(sut.find("nan"), std::string::npos);
  EXPECT_NE(sut.find("-"), std::string::npos);
}

TEST(Apart, GivesTheRowsOfAnotherProcess) {
  Row row = round_of(3, 10);
  row.note = "with \"quotes\" and\na line";
  row.targets.push_back({"none", "us", kNotMeasured, 1, true, true});
  const auto sut = measure_apart([&]() -> Result<std::vector<Row>> { return std::vector<Row>(2, row); });
  ASSERT_TRUE(sut);
  ASSERT_EQ(sut->size(), 2U);
  const Row& again = (*sut)[1];
  EXPECT_EQ(to_json({again}), to_json({row}));
  EXPECT_EQ(again.ours.values(), row.ours.values());
  EXPECT_EQ(again.note, row.note);
  EXPECT_TRUE(again.targets[1].or_equal);
  EXPECT_TRUE(again.targets[1].only_steady);
  EXPECT_TRUE(std::isnan(again.targets[1].measured));
}

TEST(Apart, SaysWhyNothingWasMeasured) {
  const auto refused =
      measure_apart([]() -> Result<std::vector<Row>> { return failure(ErrorCode::full, "no room"); });
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().describe().find("no room"), std::string::npos);
  EXPECT_FALSE(measure_apart([]() -> Result<std::vector<Row>> { std::_Exit(3); }));
}

constexpr Drawing kDrawing{.title = "title", .x = "along (s)", .y = "up", .floor = "bare", .notes = {"note"}};

std::size_t count_of(std::string_view what, const std::string& svg) {
  std::size_t count = 0;
  for (auto at = svg.find(what); at != std::string::npos; at = svg.find(what, at + 1)) ++count;
  return count;
}

TEST(Plot, DrawsASharedFloorOnce) {
  const std::vector<Row> shared{{.name = "a", .ours = one_to(3), .floor = one_to(2)},
                                {.name = "b", .ours = one_to(4), .floor = one_to(2)}};
  EXPECT_EQ(count_of("<polyline", to_svg(kDrawing, "", shared)), 3U);
  EXPECT_EQ(count_of(">floor: bare<", to_svg(kDrawing, "", shared)), 1U);
  auto apart = shared;
  apart[1].floor = one_to(3);
  EXPECT_EQ(count_of("<polyline", to_svg(kDrawing, "", apart)), 4U);
  EXPECT_EQ(count_of(">its floor: bare<", to_svg(kDrawing, "", apart)), 2U);
}

TEST(Plot, DrawsSeriesOverTimeWhereThereAreSome) {
  Row row{.name = "clock"};
  row.series = {{.name = "offset", .panel = "begin", .points = {{0, 300000}, {2, -50}}},
                {.name = "offset", .panel = "all", .points = {{0, 300000}, {10, -50}}},
                {.name = "start", .panel = "all", .points = {{0, 300000}, {10, -50}}}};
  const auto svg = to_svg(kDrawing, "", {row});
  EXPECT_EQ(count_of(">offset<", svg), 1U) << "once in the legend";
  EXPECT_EQ(count_of("<polyline", svg), 3U);
  EXPECT_EQ(count_of(">all<", svg), 1U);
  EXPECT_EQ(count_of(">10<", svg), 1U);
}

TEST(Plot, NamesItsAxes) {
  const auto svg = to_svg(kDrawing, ", busy", {{.name = "a", .ours = one_to(3), .floor = one_to(2)}});
  for (const char* const words : {">title, busy<", ">along (s)<", ">up<", ">note<"})
    EXPECT_EQ(count_of(words, svg), 1U) << words;
}

TEST(Plot, HidesNoPeakBetweenTwoPoints) {
  Row row{.name = "clock"};
  row.series = {{.name = "offset", .panel = "", .points = {}}};
  for (int i = 0; i < 100'000; ++i) row.series[0].points.emplace_back(i * 1e-3, i == 50'001 ? 1e6 : 10);
  const auto svg = to_svg(kDrawing, "", {row});
  const auto begin = svg.find("<polyline");
  const auto curve = svg.substr(begin, svg.find("/>", begin) - begin);
  EXPECT_NE(curve.find(",52.0 "), std::string::npos) << "1 ms is at the upper edge";
}

TEST(Plot, TellsEachCurveByItsMarks) {
  const std::vector<Row> rows{{.name = "a", .ours = one_to(30), .floor = one_to(20)},
                              {.name = "b", .ours = one_to(40), .floor = one_to(21)}};
  const auto svg = to_svg(kDrawing, "", rows);
  std::set<std::pair<std::string, bool>> looks;  // shape, hollow
  for (const std::string& mark : texts_between(svg, R"(class="mark" d="M)", "/>")) {
    const auto shape = texts_between(mark, " ", R"(" fill=")");
    const auto fill = texts_between(mark, R"(fill=")", R"(")");
    if (!shape.empty() && !fill.empty()) looks.emplace(shape.front(), fill.front() == "#ffffff");
  }
  EXPECT_EQ(looks.size(), 4U);
}

}  // namespace
}  // namespace plchost::bench
