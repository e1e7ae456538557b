#include "tests/bench/row.hpp"

#include <limits>
#include <regex>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/bench/plot.hpp"

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

TEST(Summary, OfNothingIsZero) {
  EXPECT_EQ(summarise(Samples()).max, 0);
}

TEST(Target, IsMetBelowItsBoundAndAtItOnlyIfSaid) {
  EXPECT_TRUE((Target{"", 1, 2}.met()));
  EXPECT_FALSE((Target{"", 2, 2}.met()));
  EXPECT_TRUE((Target{"", 2, 2, true}.met()));
  EXPECT_FALSE((Target{"", 3, 2, true}.met()));
}

TEST(Target, IsNotMetByWhatIsNoNumber) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE((Target{"", none, 2, true}.met()));
  EXPECT_FALSE((Target{"", 1, none}.met()));
}

TEST(Row, IsMetInJsonOnlyIfAllOfItsTargetsAre) {
  Row row{.name = "part/who", .ours = one_to(10), .floor = one_to(5)};
  row.extra = {{"lost", 3}};
  row.targets = {{"one", 1, 2}, {"two", 3, 2}};
  const auto json = nlohmann::json::parse(to_json({row}));
  const auto& sut = json["rows"][0];
  EXPECT_EQ(sut["name"], "part/who");
  EXPECT_EQ(sut["p50_us"], 6);
  EXPECT_EQ(sut["floor_p50_us"], 3);
  EXPECT_EQ(sut["ratio_p50"], 2);
  EXPECT_EQ(sut["extra"]["lost"], 3);
  EXPECT_EQ(sut["targets"][0]["met"], true);
  EXPECT_EQ(sut["targets"][1]["met"], false);
  EXPECT_EQ(sut["met"], false);
}

TEST(Row, WithoutATargetHasNoVerdict) {
  const auto json = nlohmann::json::parse(to_json({Row{.name = "part/who"}}));
  EXPECT_FALSE(json["rows"][0].contains("met"));
}

TEST(Table, SaysPlainlyWhatIsNotMet) {
  Row row{.name = "part/who"};
  row.targets = {{"median below 1 us", 3, 1}};
  EXPECT_NE(to_table({row}).find("NOT MET median below 1 us"), std::string::npos);
}

TEST(Markdown, HasALineForEachRowAndForEachTarget) {
  Row row{.name = "part/who", .ours = one_to(10), .floor = one_to(5)};
  row.targets = {{"median below 1 us", 3, 1}, {"median below 9 us", 3, 9}};
  const std::string sut = to_markdown({row});
  EXPECT_NE(sut.find("| `part/who` | idle | 6.00 |"), std::string::npos);
  EXPECT_NE(sut.find("| median below 1 us | 3 | 1 | **not met** |"), std::string::npos);
  EXPECT_NE(sut.find("| median below 9 us | 3 | 9 | met |"), std::string::npos);
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
  const std::regex mark(R"re(class="mark" d="M[^ ]+ ([^"]+)" fill="([^"]+)")re");
  std::set<std::pair<std::string, bool>> looks;  // shape, hollow
  for (std::sregex_iterator at(svg.begin(), svg.end(), mark), end; at != end; ++at)
    looks.emplace((*at)[1], (*at)[2] == "#ffffff");
  EXPECT_EQ(looks.size(), 4U);
}

}  // namespace
}  // namespace plchost::bench
