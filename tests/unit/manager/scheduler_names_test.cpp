#include "api/control/scheduler_names.hpp"

#include <string_view>
#include <vector>

#include <gmock/gmock.h>

#include "instances/launch/scheduler_choices.hpp"

namespace plchost {
namespace {

TEST(SchedulerNames, OfClientsAreThoseOfTheRegistry) {
  const std::vector<std::string_view> names(kSchedulerNames.begin(), kSchedulerNames.end());
  EXPECT_THAT(names, testing::UnorderedElementsAreArray(scheduler_choices()));
}

}  // namespace
}  // namespace plchost
