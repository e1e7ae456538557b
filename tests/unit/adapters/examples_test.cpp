// The examples in ST: the tasks and areas that their pages tell.
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/task_file.hpp"
#include "instances/adapters/iec/task_plan.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct Example {
  iec::Project project;
  iec::TaskPlan plan;
};

std::string text_of(const std::string& file) {
  std::ifstream stream(file);
  EXPECT_TRUE(stream) << file;
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// As each compiler has them.
class Examples : public testing::TestWithParam<iec::Compiler> {
 protected:
  void read(const std::string& name);
  Example sut;
};

/// With its task file, as a build reads it.
void Examples::read(const std::string& name) {
  const std::string file = std::string(EXAMPLES) + "/" + name + "/" + name;
  const std::vector<iec::Source> sources{{name + ".st", text_of(file + ".st")}};
  auto [project, problems] = iec::read_project(sources);
  ASSERT_THAT(problems, IsEmpty());
  sut.project = std::move(project);
  ASSERT_EQ(sut.project.configurations.size(), 1U);
  iec::Configuration& configuration = sut.project.configurations.front();
  ASSERT_THAT(iec::read_task_file({name + ".toml", text_of(file + ".toml")}, configuration), IsEmpty());
  ASSERT_EQ(configuration.resources.size(), 1U);
  sut.plan = iec::plan_tasks(sut.project, configuration, configuration.resources.front(), GetParam());
  ASSERT_THAT(sut.plan.problems, IsEmpty());
}

std::vector<std::string> tasks_of(const Example& example) {
  std::vector<std::string> tasks;
  for (const iec::PlannedTask& task : example.plan.tasks) {
    const std::string& event = task.extension.external_event;
    tasks.push_back(task.name + " " + std::to_string(task.priority) + " " +
                    (!event.empty()         ? event
                     : !task.single.empty() ? "edge of " + task.single
                                            : std::to_string(task.interval_ns / 1'000'000) + " ms"));
  }
  return tasks;
}

/// The bytes that its settings give the inputs and the outputs each.
constexpr unsigned kImage = 16;
void expect_places_in_the_areas(const Example& example) {
  for (const auto& [place, variables] : example.plan.located)
    EXPECT_LE(place.offset + place.bytes, kImage) << variables.front()->location;
}

TEST_P(Examples, TheTrafficLightHasOneTask) {
  ASSERT_NO_FATAL_FAILURE(read("traffic_light"));
  EXPECT_THAT(tasks_of(sut), ElementsAre("lights 5 20 ms"));
  expect_places_in_the_areas(sut);
}

TEST_P(Examples, TheTemperatureLoopIsOneTaskAndItsPlantAnother) {
  ASSERT_NO_FATAL_FAILURE(read("temperature"));
  EXPECT_THAT(tasks_of(sut), ElementsAre("regulate 4 50 ms", "simulate 10 10 ms"));
  expect_places_in_the_areas(sut);
}

TEST_P(Examples, ThePackingLineHasATaskOfEachKind) {
  ASSERT_NO_FATAL_FAILURE(read("packing"));
  EXPECT_THAT(tasks_of(sut),
              ElementsAre("halting 0 edge of emergency_stop", "counting 1 product", "conveying 3 10 ms"));
  expect_places_in_the_areas(sut);
}

INSTANTIATE_TEST_SUITE_P(Of, Examples, testing::Values(iec::Compiler::matiec, iec::Compiler::strucpp),
                         [](const auto& compiler) {
                           return compiler.param == iec::Compiler::matiec ? "matiec" : "strucpp";
                         });

}  // namespace
}  // namespace plchost
