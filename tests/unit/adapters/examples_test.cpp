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

/// With its task file, as a build reads it.
void read(const std::string& name, Example& example) {
  const std::string file = std::string(EXAMPLES) + "/" + name + "/" + name;
  const std::vector<iec::Source> sources{{name + ".st", text_of(file + ".st")}};
  auto [project, problems] = iec::read_project(sources);
  ASSERT_THAT(problems, IsEmpty());
  example.project = std::move(project);
  ASSERT_EQ(example.project.configurations.size(), 1U);
  iec::Configuration& configuration = example.project.configurations.front();
  ASSERT_THAT(iec::read_task_file({name + ".toml", text_of(file + ".toml")}, configuration), IsEmpty());
  ASSERT_EQ(configuration.resources.size(), 1U);
  example.plan =
      iec::plan_tasks(example.project, configuration, configuration.resources.front(), iec::Compiler::matiec);
  ASSERT_THAT(example.plan.problems, IsEmpty());
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

TEST(Examples, TheTrafficLightHasOneTask) {
  Example sut;
  ASSERT_NO_FATAL_FAILURE(read("traffic_light", sut));
  EXPECT_THAT(tasks_of(sut), ElementsAre("lights 5 20 ms"));
  expect_places_in_the_areas(sut);
}

TEST(Examples, TheTemperatureLoopIsOneTaskAndItsPlantAnother) {
  Example sut;
  ASSERT_NO_FATAL_FAILURE(read("temperature", sut));
  EXPECT_THAT(tasks_of(sut), ElementsAre("regulate 4 50 ms", "simulate 10 10 ms"));
  expect_places_in_the_areas(sut);
}

TEST(Examples, ThePackingLineHasATaskOfEachKind) {
  Example sut;
  ASSERT_NO_FATAL_FAILURE(read("packing", sut));
  EXPECT_THAT(tasks_of(sut),
              ElementsAre("halting 0 edge of emergency_stop", "counting 1 product", "conveying 3 10 ms"));
  expect_places_in_the_areas(sut);
}

}  // namespace
}  // namespace plchost
