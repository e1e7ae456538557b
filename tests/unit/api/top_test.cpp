// plcctl top: the figures between two looks, and what keys lead to.
#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>

#include "api/cli/top/top_figures.hpp"
#include "api/cli/top/top_view.hpp"
#include "api/cli/top/trend.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"

namespace plchost {
namespace {

using std::chrono::seconds;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr TrendStyle kStyle{.width = 8, .unicode = true};

plc_InstanceStatus top_instance(const char* name, std::uint32_t state, std::int32_t core) {
  plc_InstanceStatus status{};
  dds::copy_text(status.host, "cell1");
  dds::copy_text(status.instance, name);
  dds::copy_text(status.scheduler, "CmpSchedule");
  status.state = state;
  status.core = core;
  return status;
}

plc_TaskStatus top_task(const char* of, const char* name, std::uint64_t cycles) {
  plc_TaskStatus status{};
  dds::copy_text(status.host, "cell1");
  dds::copy_text(status.instance, of);
  dds::copy_text(status.task, name);
  status.cycles = cycles;
  status.exec_avg_ns = 100'000;
  return status;
}

HostLook top_plant(std::uint64_t cycles = 0) {
  HostLook look;
  look.host.name = "cell1";
  dds::copy_text(look.host.status.schedulers, "CmpSchedule,CmpScheduleTimer");
  look.instances = {top_instance("packer", 2, 1), top_instance("press", 8, 0), top_instance("robot", 2, 1)};
  look.tasks = {top_task("packer", "Fast", cycles), top_task("packer", "Slow", cycles / 10),
                top_task("robot", "Axis", 2 * cycles)};
  return look;
}

std::string top_text(const TopView& view, std::size_t width = 120, std::size_t height = 24) {
  std::string text;
  for (const TopLine& line : view.draw(width, height)) text += line.text + '\n';
  return text;
}

std::string chosen_row(const TopView& view) {
  for (const TopLine& line : view.draw(120, 24)) {
    if (line.look == TopLine::Look::chosen) return line.text;
  }
  return {};
}

void press_signs(TopView& view, std::string_view signs) {
  for (const char sign : signs) view.press({.sign = sign}, 10);
}

TEST(TopTrend, DrawsTheLastValuesAtTheRight) {
  Trend trend;
  EXPECT_EQ(trend.line(3, true), "   ");
  for (const double value : {0.0, 4.0, 8.0}) trend.add(value);
  EXPECT_EQ(trend.line(4, true), " ▁▅█");
  EXPECT_EQ(trend.line(2, true), "▅█");
  EXPECT_EQ(trend.line(3, false, 16), ".-+");
  trend.add(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(trend.line(2, true), "█ ");
}

TEST(TopTrend, ForgetsWhatIsTooLongAgo) {
  Trend trend;
  trend.add(1e9);
  for (std::size_t i = 0; i < Trend::kMost; ++i) trend.add(1);
  EXPECT_EQ(trend.line(Trend::kMost + 1, false).substr(0, 2), " #");
}

TEST(TopFigures, RatesAreOfTheTimeBetweenTwoLooks) {
  TopFigures figures;
  const TimePoint begin{};
  figures.take({top_plant(1000)}, begin);
  EXPECT_EQ(figures.task("cell1/packer/Fast").cycles_per_s, 0);  // nothing to compare with
  figures.take({top_plant(3000)}, begin + seconds(2));
  EXPECT_DOUBLE_EQ(figures.task("cell1/packer/Fast").cycles_per_s, 1000);
  EXPECT_DOUBLE_EQ(figures.task("cell1/packer/Fast").load_percent, 10);
  EXPECT_DOUBLE_EQ(figures.instance("cell1/packer").load_percent, 11);
  EXPECT_DOUBLE_EQ(figures.core("cell1/1").load_percent, 31);
  EXPECT_DOUBLE_EQ(figures.core("cell1/0").load_percent, 0);
}

TEST(TopFigures, RatesAreOfAWindow) {
  TopFigures figures;
  std::uint64_t cycles = 0;
  for (int i = 0; i <= 20; ++i) {
    figures.take({top_plant(cycles)}, TimePoint{} + seconds(i));
    cycles += i % 2 == 0 ? 120 : 80;  // as counters that come 5 times a second
  }
  EXPECT_NEAR(figures.task("cell1/packer/Fast").cycles_per_s, 100, 8);
  for (int i = 21; i < 30; ++i) figures.take({top_plant(cycles)}, TimePoint{} + seconds(i));
  EXPECT_EQ(figures.task("cell1/packer/Fast").cycles_per_s, 0);
}

TEST(TopFigures, AnApplicationThatIsLoadedAnewBeginsAnew) {
  TopFigures figures;
  figures.take({top_plant(1000)}, TimePoint{});
  figures.take({top_plant(10)}, TimePoint{} + seconds(1));
  EXPECT_EQ(figures.task("cell1/packer/Fast").cycles_per_s, 0);
  figures.take({top_plant(510)}, TimePoint{} + seconds(2));
  EXPECT_DOUBLE_EQ(figures.task("cell1/packer/Fast").cycles_per_s, 500);
}

TEST(TopFigures, ForgetWhatIsGone) {
  TopFigures figures;
  figures.take({top_plant(0)}, TimePoint{});
  figures.take({top_plant(1000)}, TimePoint{} + seconds(1));
  figures.take({}, TimePoint{} + seconds(2));
  EXPECT_EQ(figures.task("cell1/packer/Fast").cycles_per_s, 0);
  EXPECT_EQ(figures.instance("cell1/packer").load_percent, 0);
  EXPECT_EQ(figures.core("cell1/1").load.line(2, false), "  ");
}

plc_DurationHistogram histogram_of(std::vector<plc_HistogramBar>& bars) {
  plc_DurationHistogram made{};
  for (const plc_HistogramBar& bar : bars) made.total += bar.count;
  dds::lend(made.bars, bars);
  return made;
}

TEST(TopFigures, PercentileIsOfTheIntervalAlone) {
  std::vector<plc_HistogramBar> before = {{.lower_ns = 1000, .count = 50}, {.lower_ns = 9000, .count = 1000}};
  std::vector<plc_HistogramBar> now = {
      {.lower_ns = 1000, .count = 149}, {.lower_ns = 2000, .count = 1}, {.lower_ns = 9000, .count = 1000}};
  EXPECT_EQ(percentile_between(histogram_of(before), histogram_of(now)), 1000);
  now[1].count = 3;
  EXPECT_EQ(percentile_between(histogram_of(before), histogram_of(now)), 2000);
  EXPECT_EQ(percentile_between(histogram_of(now), histogram_of(now)), std::nullopt);
  EXPECT_EQ(percentile_between(histogram_of(now), histogram_of(before)), 9000);  // it began anew
}

class TopViewTest : public testing::Test {
 protected:
  TopViewTest() { look(); }
  void look(const std::vector<HostLook>& hosts = {top_plant()}) { view_.show(hosts, figures_); }

  TopFigures figures_;
  TopView view_{kStyle};
};

TEST_F(TopViewTest, CountsStatesAndShowsEachInstance) {
  EXPECT_THAT(top_text(view_), AllOf(HasSubstr("1 host, 3 instances, 1 exception, 2 running"),
                                     HasSubstr("packer"), HasSubstr("press"), HasSubstr("robot")));
}

TEST_F(TopViewTest, FitsEverySizeOfATerminal) {
  for (std::size_t width = 0; width < 200; width += 7) {
    for (std::size_t height = 0; height < 40; ++height) {
      const auto lines = view_.draw(width, height);
      EXPECT_EQ(lines.size(), height);
      for (const TopLine& line : lines) EXPECT_EQ(cut_to(line.text, width), line.text);
    }
  }
}

TEST_F(TopViewTest, CutsBetweenCharacters) {
  EXPECT_EQ(cut_to("▁▂▃", 2), "▁▂");
  EXPECT_EQ(cut_to("ab", 5), "ab");
  EXPECT_EQ(cut_to("ab", 0), "");
}

TEST_F(TopViewTest, ChoiceStaysOnItsRow) {
  view_.press({.kind = TopKey::Kind::end}, 10);
  EXPECT_THAT(chosen_row(view_), HasSubstr("robot"));
  HostLook other = top_plant();
  other.instances.insert(other.instances.begin(), top_instance("an_earlier_one", 2, 1));
  look({other});
  EXPECT_THAT(chosen_row(view_), HasSubstr("robot"));
  look({});
  EXPECT_THAT(top_text(view_), HasSubstr("no host answers"));
}

TEST_F(TopViewTest, EnterLooksIntoAnInstanceAndEscapeComesBack) {
  view_.press({.kind = TopKey::Kind::enter}, 10);
  EXPECT_EQ(view_.inside(), "cell1/packer");
  EXPECT_THAT(top_text(view_), AllOf(HasSubstr("Fast"), HasSubstr("Slow"), Not(HasSubstr("Axis")),
                                     HasSubstr("no cycle was lost"), HasSubstr("no exception")));
  view_.press({.kind = TopKey::Kind::escape}, 10);
  EXPECT_EQ(view_.inside(), "");
  EXPECT_THAT(chosen_row(view_), HasSubstr("packer"));
}

TEST_F(TopViewTest, PagesAreTasksAndCores) {
  press_signs(view_, "2");
  EXPECT_THAT(top_text(view_), AllOf(HasSubstr("Axis"), HasSubstr("Fast")));
  press_signs(view_, "3");
  EXPECT_THAT(top_text(view_), HasSubstr("packer, robot"));
}

TEST_F(TopViewTest, SortsByAColumnEitherWay) {
  press_signs(view_, ">>");  // as they come, host, instance
  press_signs(view_, "r");
  view_.press({.kind = TopKey::Kind::home}, 10);
  EXPECT_THAT(chosen_row(view_), HasSubstr("robot"));
  press_signs(view_, "r");
  view_.press({.kind = TopKey::Kind::home}, 10);
  EXPECT_THAT(chosen_row(view_), HasSubstr("packer"));
}

TEST_F(TopViewTest, FilterHidesRowsUntilItEnds) {
  press_signs(view_, "/ro");
  EXPECT_THAT(top_text(view_), AllOf(HasSubstr("robot"), Not(HasSubstr("packer"))));
  view_.press({.kind = TopKey::Kind::enter}, 10);
  press_signs(view_, "/q");  // a sign of the filter, not the end
  EXPECT_FALSE(view_.ended());
  EXPECT_THAT(top_text(view_), HasSubstr("nothing to show"));
  view_.press({.kind = TopKey::Kind::escape}, 10);
  EXPECT_THAT(top_text(view_), HasSubstr("packer"));
}

TEST_F(TopViewTest, CommandsAreGivenWhenTheyAreConfirmed) {
  press_signs(view_, "T");
  EXPECT_THAT(top_text(view_), HasSubstr("Stop packer of cell1? y: yes"));
  EXPECT_FALSE(view_.take_command());
  press_signs(view_, "n");
  EXPECT_FALSE(view_.take_command());
  EXPECT_THAT(top_text(view_), HasSubstr("not done"));
  press_signs(view_, "Ty");
  const auto command = view_.take_command();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->host, "cell1");
  EXPECT_EQ(command->instance, "packer");
  EXPECT_EQ(command->operation, plc_OPERATION_STOP);
  EXPECT_FALSE(view_.take_command());
}

TEST_F(TopViewTest, ASchedulerIsOneOfTheHosts) {
  press_signs(view_, "W");
  EXPECT_THAT(top_text(view_), HasSubstr("1: CmpSchedule 2: CmpScheduleTimer"));
  press_signs(view_, "3");
  EXPECT_FALSE(view_.take_command());
  press_signs(view_, "W2y");
  const auto command = view_.take_command();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->operation, plc_OPERATION_SET_SCHEDULER);
  EXPECT_EQ(command->argument, "CmpScheduleTimer");
}

TEST_F(TopViewTest, TextsOfAHostDriveNoTerminal) {
  HostLook evil = top_plant();
  dds::copy_text(evil.instances[0].problem, "a\x1b[2Jb{}");
  dds::copy_text(evil.host.status.schedulers, "{0}\x1b[31m");
  look({evil});
  EXPECT_THAT(top_text(view_, 300), Not(HasSubstr("\x1b")));
  press_signs(view_, "W1");
  EXPECT_THAT(top_text(view_), AllOf(HasSubstr("{0}"), Not(HasSubstr("\x1b"))));
}

TEST_F(TopViewTest, HelpNamesEachKeyAndAnyKeyEndsIt) {
  press_signs(view_, "?");
  EXPECT_THAT(top_text(view_), HasSubstr("switch the scheduler"));
  press_signs(view_, "q");
  EXPECT_FALSE(view_.ended());
  press_signs(view_, "q");
  EXPECT_TRUE(view_.ended());
}

}  // namespace
}  // namespace plchost
