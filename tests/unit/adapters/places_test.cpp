// The exchange of located variables with the memory area, in the order in which the cycles of two tasks come.
// Tasks that interrupt each other in the midst of it: tests/models/places_model.cpp.

#include <array>
#include <cstring>

#include <gtest/gtest.h>

#include "instances/adapters/application/plchost_adapter.h"
#include "instances/plc_app.h"

namespace {

unsigned short value = 0;
std::array<unsigned char, 2> area{};
plchost_use by_first{.place = 0, .value = &value, .others = 0, .before = 0};
plchost_use by_second = by_first;

plchost_task task_that_has(const char* name, plchost_use* use) {
  plchost_task task{};
  task.name = name;
  task.uses_count = 1;
  task.uses = use;
  return task;
}

}  // namespace

// The file that plcctl writes, and the runtime.
extern "C" {
const unsigned int plchost_place_count = 1;
const plchost_place plchost_places[] = {{"__MW0", 'M', 2, -1, 0, 0, &value}};
unsigned long long plchost_exchanged[1];
const unsigned int plchost_location_count = 0;
const plchost_location plchost_locations[] = {{"", 0}};
const unsigned int plchost_task_count = 2;
const plchost_task plchost_tasks[] = {task_that_has("first", &by_first), task_that_has("second", &by_second)};

RTS_HANDLE plc_declare_area(const Plc_Area* declared, RTS_RESULT* /*result*/) {
  std::memcpy(area.data(), declared->pInitial, declared->dwBytes);
  return area.data();
}
void* plc_area_address(RTS_HANDLE /*area*/) {
  return area.data();
}
RTS_RESULT plc_keep_variables(const char* /*name*/, void* /*address*/, unsigned int /*bytes*/,
                              RTS_UI64 /*layout*/) {
  return ERR_OK;
}
int plc_online_change() {
  return 0;
}
}

namespace plchost::adapters {
namespace {

constexpr int kMostLeft = 200;  // cycles, as in places.c

class Places : public ::testing::Test {
 protected:
  Places() {
    value = 0;
    plchost_exchanged[0] = 0;
    EXPECT_EQ(plchost_declare_places(), 1);
  }
  ~Places() override { plchost_forget_places(); }

  static void begin(unsigned task) { plchost_take_places(&plchost_tasks[task]); }
  static void end(unsigned task) { plchost_put_places(&plchost_tasks[task]); }
  static void cycle(unsigned task) {
    begin(task);
    end(task);
  }
  static int in_area() { return area[0] | area[1] << 8; }
};

TEST_F(Places, AreLeftToTheTaskThatIsInTheMidstOfItsCycle) {
  begin(1);
  value = 0x1234;
  cycle(0);
  EXPECT_EQ(in_area(), 0) << "the first task has not changed it";
  end(1);
  EXPECT_EQ(in_area(), 0x1234);
}

TEST_F(Places, ArePutOutAlsoIfATaskDoesNotComeToItsEnd) {
  begin(1);
  value = 0x1234;  // and a fault stops it
  for (int i = 0; i < kMostLeft; ++i) {
    cycle(0);
    ASSERT_EQ(in_area(), 0) << "cycle " << i;
  }
  cycle(0);
  EXPECT_EQ(in_area(), 0x1234);
  value = 0x4321;  // by an operator
  for (int i = 0; i < kMostLeft; ++i) cycle(0);
  EXPECT_EQ(in_area(), 0x1234) << "the count begins anew";
  cycle(0);
  EXPECT_EQ(in_area(), 0x4321);
}

TEST_F(Places, OfATaskThatDoesNotComeToItsEndAreTakenAndPutByAnotherOne) {
  begin(1);
  area = {7, 0};
  cycle(0);
  EXPECT_EQ(value, 7) << "of others";
  begin(0);
  value = 8;
  end(0);
  EXPECT_EQ(in_area(), 8) << "that this task has changed";
}

}  // namespace
}  // namespace plchost::adapters
