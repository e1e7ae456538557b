#include "instances/runtime/application/compare_versions.hpp"

#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

TaskConfig main_task() {
  TaskConfig task;
  task.name = "Main";
  task.iec_priority = 3;
  task.interval = 10ms;
  task.watchdog.time = 5ms;
  return task;
}

TaskConfig external_task() {
  TaskConfig task;
  task.name = "Ready";
  task.kind = TaskKind::external;
  task.external_event = "ready";
  return task;
}

TEST(TasksOfTwoVersions, AreTheSameInAnyOrderWithOtherCode) {
  TaskConfig other = main_task();
  other.entry = [] {};
  EXPECT_THAT(compare_tasks(std::vector{main_task(), external_task()}, std::vector{external_task(), other}),
              IsEmpty());
}

TEST(TasksOfTwoVersions, MayNotComeOrGo) {
  EXPECT_THAT(compare_tasks(std::vector{main_task()}, std::vector{external_task()}),
              ElementsAre("task 'Main' is gone", "task 'Ready' is new"));
}

struct OneTask {
  const char* name;
  std::function<void(TaskConfig&)> change;
  const char* line;
};

class ADifferenceOfATask : public ::testing::TestWithParam<OneTask> {};

TEST_P(ADifferenceOfATask, IsTold) {
  TaskConfig next = main_task();
  GetParam().change(next);
  EXPECT_THAT(compare_tasks(std::vector{main_task()}, std::vector{next}), ElementsAre(GetParam().line));
}

INSTANTIATE_TEST_SUITE_P(
    Each, ADifferenceOfATask,
    ::testing::Values(
        OneTask{"kind", [](TaskConfig& task) { task.kind = TaskKind::freewheeling; },
                "task 'Main': its kind is freewheeling, of the one that runs it is cyclic"},
        OneTask{"priority", [](TaskConfig& task) { task.iec_priority = 4; },
                "task 'Main': its priority is 4, of the one that runs it is 3"},
        OneTask{"interval", [](TaskConfig& task) { task.interval = 10us; },
                "task 'Main': its interval is 10 us, of the one that runs it is 10000 us"},
        OneTask{"offset", [](TaskConfig& task) { task.start_offset = Duration(1); },
                "task 'Main': its start offset is 0.001 us, of the one that runs it is 0 us"},
        OneTask{"late", [](TaskConfig& task) { task.late = LatePolicy::asap; },
                "task 'Main': LatePolicy=Asap is set, of the one that runs it is not set"},
        OneTask{"outputs", [](TaskConfig& task) { task.drives_outputs = true; },
                "task 'Main': DrivesOutputs is set, of the one that runs it is not set"},
        OneTask{"time", [](TaskConfig& task) { task.watchdog.time = 0ms; },
                "task 'Main': its watchdog's time is 0 us, of the one that runs it is 5000 us"},
        OneTask{"sensitivity", [](TaskConfig& task) { task.watchdog.sensitivity = 9; },
                "task 'Main': its watchdog's sensitivity is 9, of the one that runs it is 1"},
        OneTask{"omitted", [](TaskConfig& task) { task.watchdog.omitted_cycles = 9; },
                "task 'Main': its watchdog's omitted cycles is 9, of the one that runs it is 0"},
        OneTask{"policy", [](TaskConfig& task) { task.watchdog.policy = WatchdogPolicy::task; },
                "task 'Main': its watchdog's Policy=Task is set, of the one that runs it is not set"}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST(TasksOfTwoVersions, WaitForTheSameEvent) {
  TaskConfig next = external_task();
  next.external_event = "done";
  EXPECT_THAT(compare_tasks(std::vector{external_task()}, std::vector{next}),
              ElementsAre("task 'Ready': its external event is done, of the one that runs it is ready"));
}

DeclaredArea area_named(const char* name) {
  return {.name = name,
          .flags = PLC_AREA_OUTPUT,
          .bytes = 16,
          .layout = 1,
          .uses = {{.task = "A", .offset = 0, .bytes = 8}, {.task = "B"}},
          .initial = {},
          .address = nullptr};
}

TEST(AreasOfTwoVersions, AreTheSameInAnyOrderWithOtherInitialValues) {
  DeclaredArea next = area_named("a");
  next.uses = {{.task = "B"}, {.task = "A", .offset = 0, .bytes = 8}};
  next.initial.resize(16);
  EXPECT_THAT(
      compare_areas(std::vector{area_named("a"), area_named("b")}, std::vector{area_named("b"), next}),
      IsEmpty());
}

TEST(AreasOfTwoVersions, MayNotComeGoOrBeOthers) {
  DeclaredArea next = area_named("a");
  next.flags = 0x12;
  next.bytes = 32;
  next.layout = 2;
  next.uses = {{.task = "A", .offset = 8, .bytes = 8}};
  EXPECT_THAT(
      compare_areas(std::vector{area_named("a"), area_named("b")}, std::vector{next, area_named("c")}),
      UnorderedElementsAre("area 'a': dwFlags is 0x12, of the one that runs it is 0x8",
                           "area 'a': dwBytes is 32, of the one that runs it is 16",
                           "area 'a': qwLayout is 2, of the one that runs it is 1",
                           "area 'a': the tasks that use it is A 8+8, of the one that runs it is A 0+8, B",
                           "area 'b' is gone", "area 'c' is new"));
}

TEST(VariablesOfTwoVersions, MayComeAndGoButNotChangeTheirLayout) {
  const CarriedByName running{{"same", {.bytes = 8, .layout = 1}},
                              {"gone", {.bytes = 8}},
                              {"larger", {.bytes = 8}},
                              {"other", {.bytes = 8, .layout = 1}}};
  const CarriedByName next{{"other", {.bytes = 8, .layout = 2}},
                           {"larger", {.bytes = 12}},
                           {"new", {.bytes = 1}},
                           {"same", {.bytes = 8, .layout = 1}}};
  EXPECT_THAT(compare_variables(running, next),
              ElementsAre("variables 'larger': dwBytes is 12, of the one that runs it is 8",
                          "variables 'other': qwLayout is 2, of the one that runs it is 1"));
}

TEST(VariablesOfTwoVersions, AreNamedWithTheirTypesWhereBothAreSeen) {
  const CarriedByName running{{"MAIN.SPEED", {.bytes = 2, .layout = 1}}, {"MAIN.PART", {.bytes = 8}}};
  const CarriedByName next{{"MAIN.SPEED", {.bytes = 4, .layout = 2}}, {"MAIN.PART", {.bytes = 9}}};
  const std::vector<VariableSymbol> was{{.name = "Main.speed", .type = VariableType::int_, .bytes = 2}};
  const std::vector<VariableSymbol> is{{.name = "Main.speed", .type = VariableType::dint, .bytes = 4}};
  EXPECT_THAT(compare_variables(running, next, {.running = was, .next = is}),
              ElementsAre("variables 'MAIN.PART': dwBytes is 9, of the one that runs it is 8",
                          "variable 'Main.speed': its type is DINT, of the one that runs it is INT"));
}

TEST(VariablesOfTwoVersions, AreNamedByTheirMembers) {
  const CarriedByName running{{"MAIN.PART", {.bytes = 8, .layout = 1}}};
  const CarriedByName next{{"MAIN.PART", {.bytes = 8, .layout = 2}}};
  const VariableSymbol hours{.name = "Main.part.hours", .type = VariableType::dint, .bytes = 4};
  const VariableSymbol parts{.name = "Main.parts", .type = VariableType::dint, .bytes = 4};
  VariableSymbol gone = hours;
  gone.name = "Main.part[].x";
  gone.dimensions = {{.first = 1, .count = 4}};
  VariableSymbol added = hours;
  added.name = "Main.part.minutes";
  EXPECT_THAT(
      compare_variables(running, next,
                        {.running = std::vector{hours, gone, parts}, .next = std::vector{hours, added}}),
      ElementsAre("variable 'Main.part[].x' is gone", "variable 'Main.part.minutes' is new"));
  EXPECT_THAT(compare_variables(running, next, {.running = std::vector{hours}, .next = std::vector{hours}}),
              ElementsAre("variables 'MAIN.PART': qwLayout is 2, of the one that runs it is 1"));
}

TEST(AreasOfTwoVersions, AreNamedByTheVariablesInThem) {
  DeclaredArea running = area_named("retain");
  DeclaredArea next = running;
  next.layout = 2;
  const VariableSymbol total{.name = "Main.total",
                             .type = VariableType::dint,
                             .bytes = 4,
                             .dimensions = {},
                             .task = "A",
                             .area = "retain"};
  VariableSymbol larger = total;
  larger.type = VariableType::lint;
  VariableSymbol added = total;
  added.name = "Main.added";
  VariableSymbol other = total;
  other.name = "Main.other";
  other.area = "%QX0.0";
  EXPECT_THAT(
      compare_areas(std::vector{running}, std::vector{next},
                    {.running = std::vector{total}, .next = std::vector{added, other, larger}}),
      ElementsAre("area 'retain': variable 'Main.total': its type is LINT, of the one that runs it is DINT",
                  "area 'retain': variable 'Main.added' is new"));
  EXPECT_THAT(compare_areas(std::vector{running}, std::vector{next},
                            {.running = std::vector{total}, .next = std::vector{total}}),
              ElementsAre("area 'retain': qwLayout is 2, of the one that runs it is 1"));
}

}  // namespace
}  // namespace plchost
