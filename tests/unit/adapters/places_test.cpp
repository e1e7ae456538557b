// The exchange of located variables with their areas, in the order in which the cycles of tasks come. Tasks
// that interrupt each other in the midst of it: tests/models/places_model.cpp.

#include <array>
#include <cstddef>
#include <cstring>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "instances/adapters/application/plchost_adapter.h"
#include "instances/plc_app.h"

namespace {

using Bytes = std::array<unsigned char, 4>;

unsigned short value = 0;        // %MW0
unsigned short output_word = 0;  // %QW0
unsigned char output_bit = 0;    // %QX0.0
unsigned short memory_word = 0;  // %MW1
unsigned char memory_bit = 0;    // %MX2.0
unsigned char memory_new = 0;    // %MX2.1
Bytes memory{};
Bytes outputs{};

// Those of a task that share bits come first, in a ring.
plchost_use use_of(unsigned place, void* value_of_place, unsigned next = 0) {
  plchost_use use{};
  use.place = place;
  use.value = value_of_place;
  use.next = next;
  return use;
}
std::array of_first{use_of(1, &output_word, 1), use_of(2, &output_bit), use_of(0, &value)};
std::array of_second{use_of(3, &memory_word, 1), use_of(4, &memory_bit, 2), use_of(5, &memory_new),
                     use_of(0, &value)};
std::array of_word{use_of(3, &memory_word)};
std::array of_bit{use_of(4, &memory_bit)};

template <std::size_t N>
plchost_task task_that_has(const char* name, std::array<plchost_use, N>& uses, unsigned sharing) {
  plchost_task task{};
  task.name = name;
  task.uses_count = N;
  task.uses = uses.data();
  task.sharing_count = sharing;
  return task;
}

std::array<int, 4> stopped{};
int takes_over = 0;
std::map<std::string, void*> kept;

}  // namespace

// The file that plcctl writes, and the runtime.
extern "C" {
const unsigned int plchost_place_count = 6;
const plchost_place plchost_places[] = {
    {"__MW0", 'M', 2, -1, 0, 0, &value},       {"__QW0", 'Q', 2, -1, 1, 0, &output_word},
    {"__QX0_0", 'Q', 1, 0, 1, 0, &output_bit}, {"__MW1", 'M', 2, -1, 1, 2, &memory_word},
    {"__MX2_0", 'M', 1, 0, 1, 2, &memory_bit}, {"__MX2_1", 'M', 1, 1, 1, 2, &memory_new}};
unsigned long long plchost_exchanged[6];
const unsigned int plchost_location_count = 0;
const plchost_location plchost_locations[] = {{"", 0}};
const unsigned int plchost_task_count = 4;
const plchost_task plchost_tasks[] = {task_that_has("first", of_first, 2),
                                      task_that_has("second", of_second, 3),
                                      task_that_has("word", of_word, 0), task_that_has("bit", of_bit, 0)};

RTS_HANDLE plc_declare_area(const Plc_Area* declared, RTS_RESULT* /*result*/) {
  Bytes& area = declared->dwFlags == PLC_AREA_MEMORY ? memory : outputs;
  if (takes_over == 0) std::memcpy(area.data(), declared->pInitial, declared->dwBytes);
  return area.data();
}
void* plc_area_address(RTS_HANDLE area) {
  return area;
}
RTS_RESULT plc_keep_variables(const char* name, void* address, unsigned int /*bytes*/, RTS_UI64 /*layout*/) {
  kept[name] = address;
  return ERR_OK;
}
int plc_online_change() {
  return takes_over;
}
int plchost_is_stopped(unsigned int task) {
  return stopped.at(task);
}
}

namespace plchost::adapters {
namespace {

enum Task : unsigned { kFirst, kSecond, kOfWord, kOfBit };

class Places : public ::testing::Test {
 protected:
  Places() {
    stopped = {};
    kept.clear();
    for (auto* const word : {&value, &output_word, &memory_word}) *word = 0;
    for (auto* const bit : {&output_bit, &memory_bit, &memory_new}) *bit = 0;
    for (const plchost_task& task : plchost_tasks)
      for (unsigned i = 0; i < task.sharing_count; ++i) task.uses[i].seen = 0;
    declare();
  }
  ~Places() override { plchost_forget_places(); }

  static void declare() { EXPECT_EQ(plchost_declare_places(), 1); }
  static void begin(Task task) { plchost_take_places(&plchost_tasks[task]); }
  static void end(Task task) {
    plchost_settle_places(&plchost_tasks[task]);
    plchost_put_places(&plchost_tasks[task]);
  }
  static void cycle(Task task) {
    begin(task);
    end(task);
  }
  template <class T>
  static void assign(Task task, T& variable, T now) {
    EXPECT_EQ(plchost_assign_place(&plchost_tasks[task], &variable, &now), 1);
  }
  static int word_of(const Bytes& area, std::size_t at = 0) { return area.at(at) | area.at(at + 1) << 8; }
  static int in_area() { return word_of(memory); }
};

TEST_F(Places, AreLeftToTheTaskThatIsInTheMidstOfItsCycle) {
  begin(kSecond);
  value = 0x1234;
  for (int i = 0; i < 1000; ++i) {
    cycle(kFirst);
    ASSERT_EQ(in_area(), 0) << "the first task has not changed it, in cycle " << i;
  }
  end(kSecond);
  EXPECT_EQ(in_area(), 0x1234);
}

TEST_F(Places, OfManyCyclesAreLeftInEachOfThem) {
  for (int i = 0; i < 1000; ++i) {
    begin(kSecond);
    value = 97;
    cycle(kFirst);
    ASSERT_EQ(in_area(), i == 0 ? 0 : 100) << "a value in the midst of cycle " << i << " has come out";
    value = 100;
    end(kSecond);
    ASSERT_EQ(in_area(), 100);
  }
}

TEST_F(Places, ArePutOutAlsoIfATaskDoesNotComeToItsEnd) {
  begin(kSecond);
  value = 0x1234;
  cycle(kFirst);
  ASSERT_EQ(in_area(), 0);
  stopped.at(kSecond) = 1;  // by a fault
  cycle(kFirst);
  EXPECT_EQ(in_area(), 0x1234);
  value = 0x4321;  // by an operator
  cycle(kFirst);
  EXPECT_EQ(in_area(), 0x4321);
}

TEST_F(Places, OfATaskThatDoesNotComeToItsEndAreTakenAndPutByAnotherOne) {
  begin(kSecond);
  memory = {7, 0};
  cycle(kFirst);
  EXPECT_EQ(value, 7) << "of others";
  begin(kFirst);
  value = 8;
  end(kFirst);
  EXPECT_EQ(in_area(), 8) << "that this task has changed";
}

TEST_F(Places, ThatShareBitsHaveTheirStatementsInOrderInEachCycle) {
  for (int i = 0; i < 3; ++i) {
    begin(kFirst);
    assign<unsigned short>(kFirst, output_word, 0x0100);
    assign<unsigned char>(kFirst, output_bit, 1);
    EXPECT_EQ(output_word, 0x0101);
    end(kFirst);
    ASSERT_EQ(word_of(outputs), 0x0101) << "cycle " << i;
  }
  begin(kFirst);
  assign<unsigned char>(kFirst, output_bit, 1);
  assign<unsigned short>(kFirst, output_word, 0x0200);
  EXPECT_EQ(output_bit, 0);
  end(kFirst);
  EXPECT_EQ(word_of(outputs), 0x0200);
}

TEST_F(Places, ThatShareBitsAreOneMemoryAlsoIfAReferenceAssignsOne) {
  begin(kFirst);
  output_word = 0x0101;
  end(kFirst);
  EXPECT_EQ(output_bit, 1);
  begin(kFirst);
  output_bit = 0;
  end(kFirst);
  EXPECT_EQ(output_word, 0x0100);
  EXPECT_EQ(word_of(outputs), 0x0100);
}

TEST_F(Places, ThatShareBitsKeepWhatAnOperatorWrites) {
  cycle(kFirst);
  output_bit = 1;
  cycle(kFirst);
  EXPECT_EQ(output_bit, 1);
  EXPECT_EQ(word_of(outputs), 0x0001);
  output_word = 0x0200;
  cycle(kFirst);
  EXPECT_EQ(output_bit, 0);
  EXPECT_EQ(word_of(outputs), 0x0200);
}

// As plchost_end() does.
TEST_F(Places, ThatShareBitsHaveTheForcedOneInEachCycle) {
  for (int i = 0; i < 3; ++i) {
    begin(kFirst);
    assign<unsigned short>(kFirst, output_word, 0x0100);
    plchost_settle_places(&plchost_tasks[kFirst]);
    output_bit = 1;
    EXPECT_EQ(plchost_settle_forced_places(&plchost_tasks[kFirst]), 1);
    plchost_put_places(&plchost_tasks[kFirst]);
    ASSERT_EQ(word_of(outputs), 0x0101) << "cycle " << i;
  }
  for (int i = 0; i < 3; ++i) {
    begin(kSecond);
    assign<unsigned short>(kSecond, memory_word, 0x0100);
    plchost_settle_places(&plchost_tasks[kSecond]);
    memory_bit = 1;
    EXPECT_EQ(plchost_settle_forced_places(&plchost_tasks[kSecond]), 1);
    plchost_put_places(&plchost_tasks[kSecond]);
    ASSERT_EQ(word_of(memory, 2), 0x0101) << "cycle " << i;
  }
}

TEST_F(Places, ThatShareBitsLoseNoneThatAnotherTaskAssigns) {
  begin(kOfWord);
  begin(kOfBit);
  memory_bit = 1;
  end(kOfBit);
  memory_word = memory_word ^ 0x0100;
  end(kOfWord);
  EXPECT_EQ(word_of(memory, 2), 0x0101);
  cycle(kOfBit);
  EXPECT_EQ(memory_bit, 1);
  cycle(kOfWord);
  EXPECT_EQ(memory_word, 0x0101);
}

TEST_F(Places, ThatShareBitsArePutOnce) {
  begin(kSecond);
  assign<unsigned char>(kSecond, memory_bit, 1);
  end(kSecond);
  ASSERT_EQ(word_of(memory, 2), 1);
  memory.at(2) = 0;  // the firmware has seen it
  end(kSecond);
  EXPECT_EQ(word_of(memory, 2), 0);
  cycle(kOfBit);
  EXPECT_EQ(memory_bit, 0);
  EXPECT_EQ(word_of(memory, 2), 0);
}

// The next version of a program. Its values are copied before its first cycle.
class NewPlaces : public Places {
 protected:
  NewPlaces() {
    plchost_forget_places();
    takes_over = 1;
    memory = {5, 0, 0x20, 0};
  }
  ~NewPlaces() override { takes_over = 0; }
  template <class T>
  static void carry(const char* name, T from) {
    std::memcpy(kept.at(name), &from, sizeof from);
  }
  static void carry_word(unsigned short from) {
    carry<unsigned char>("exchanged", 1);
    carry<unsigned short>("__MW1", from);
    carry<unsigned long long>("area-__MW1", from);
  }
};

TEST_F(NewPlaces, BeginWithTheirInitialValues) {
  value = 7;
  memory_new = 1;
  declare();
  carry_word(0x20);
  cycle(kFirst);
  EXPECT_EQ(in_area(), 7);
  cycle(kSecond);
  EXPECT_EQ(memory_new, 1);
  EXPECT_EQ(memory_word, 0x22) << "and so have those that share its bits";
  EXPECT_EQ(word_of(memory, 2), 0x22);
}

TEST_F(NewPlaces, WithoutAnInitialValueBeginWithThatOfTheArea) {
  declare();
  carry_word(0x20);
  cycle(kFirst);
  EXPECT_EQ(value, 5);
  memory.at(2) = 3;
  cycle(kSecond);
  EXPECT_EQ(memory_new, 1);
  EXPECT_EQ(memory_word, 3);
}

TEST_F(NewPlaces, TakeNothingForNewIfTheVersionBeforeHasNotToldIt) {
  declare();
  value = 7;
  cycle(kFirst);
  EXPECT_EQ(value, 5) << "as the firmware has changed it";
}

}  // namespace
}  // namespace plchost::adapters
