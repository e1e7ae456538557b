// Located variables in the memory area. The tasks of one application share a core and interrupt each other at
// any step. Firmware writes the area. It only writes one value there, so each of its executions on another
// core is also one in which it writes between two steps of the tasks.
//
// * An assigned value is neither lost nor undone: when all cycles have ended, the area and the program have
//   the value of the last assignment. It may be the value of before again.
// * A value of the firmware is not undone by tasks that have assigned nothing: after their next cycle the
//   area and the program have it.
// * If firmware writes before a task has put its assigned value, that one holds. In each case the area
//   and the program have one value after the next cycle.
// * If two tasks and firmware each set a bit of one byte, all three are set.

#include <cstring>
#include <functional>

#include "instances/adapters/application/plchost_adapter.h"
#include "instances/plc_app.h"
#include "tests/models/checker/model.hpp"

namespace {

/// The values of the program, as a compiler lays them out.
struct Program {
  unsigned word;
  unsigned char first;
  unsigned char second;
};
Program program;

struct alignas(8) Area {
  unsigned char bits;
  unsigned char unused[3];
  unsigned word;
};
Area area;

plchost_use low_word{.place = 0, .value = &program.word, .others = 0, .before = 0};
plchost_use high_word = low_word;
plchost_use first_bit{.place = 1, .value = &program.first, .others = 0, .before = 0};
plchost_use second_bit{.place = 2, .value = &program.second, .others = 0, .before = 0};

plchost_task task_that_has(const char* name, plchost_use* use) {
  plchost_task task{};
  task.name = name;
  task.uses_count = 1;
  task.uses = use;
  return task;
}

}  // namespace

// The file that plcctl writes.
extern "C" {
const unsigned int plchost_place_count = 3;
const plchost_place plchost_places[] = {{"__MD1", 'M', 4, -1, 0, 4, &program.word},
                                        {"__MX0_0", 'M', 1, 0, 0, 0, &program.first},
                                        {"__MX0_1", 'M', 1, 1, 0, 0, &program.second}};
unsigned long long plchost_exchanged[3];
const unsigned int plchost_location_count = 0;
const plchost_location plchost_locations[] = {{"", 0}};
const unsigned int plchost_task_count = 4;
const plchost_task plchost_tasks[] = {task_that_has("low", &low_word), task_that_has("high", &high_word),
                                      task_that_has("first bit", &first_bit),
                                      task_that_has("second bit", &second_bit)};

// The runtime.
RTS_HANDLE plc_declare_area(const Plc_Area* declared, RTS_RESULT* /*result*/) {
  std::memcpy(&area, declared->pInitial, declared->dwBytes);
  return &area;
}
void* plc_area_address(RTS_HANDLE /*handle*/) {
  return &area;
}
RTS_RESULT plc_keep_variables(const char* /*name*/, void* /*address*/, unsigned int /*bytes*/,
                              RTS_UI64 /*layout*/) {
  return ERR_OK;
}
int plc_online_change() {
  return 0;
}
}

namespace plchost::models {
namespace {

enum Task : unsigned { kLow, kHigh, kFirstBit, kSecondBit };

constexpr ThreadOptions kOnTheCore{.core = 0};

void cycle(Task task, const std::function<void()>& code = [] {}) {
  plchost_take_places(&plchost_tasks[task]);
  code();
  plchost_put_places(&plchost_tasks[task]);
}

unsigned word_now() {
  return __atomic_load_n(&program.word, __ATOMIC_RELAXED);
}
void assign(unsigned value) {
  __atomic_store_n(&program.word, value, __ATOMIC_RELAXED);
}
void write_by_firmware(unsigned value) {
  __atomic_store_n(&area.word, value, __ATOMIC_RELAXED);
}

void set_up(Scene& scene) {
  program = {};
  area = {};
  for (unsigned long long& exchanged : plchost_exchanged) exchanged = 0;
  require(plchost_declare_places() == 1, "the places cannot be declared");
  cycle(kLow);  // the first one of an application is another one
  scene.name(program.word, "value");
  scene.name(area.word, "area");
  scene.name(area.bits, "bits of the area");
  scene.name(plchost_exchanged, "exchanged");
}

// The next cycles of tasks that do nothing find, and leave, one value.
void require_one_value() {
  cycle(kLow);
  require(word_now() == area.word, "the program and the area have two values");
  cycle(kHigh);
  require(word_now() == area.word, "the program and the area have two values");
}

void two_tasks_assign(Scene& scene) {
  set_up(scene);
  scene.thread("low", [] { cycle(kLow, [] { assign(1); }); }, kOnTheCore);
  scene.thread("high", [] { cycle(kHigh, [] { assign(2); }); }, kOnTheCore);
  scene.at_end([] {
    require(program.word != 0, "an assigned value is undone");
    require(area.word == program.word, "the area has not the value that was assigned last");
    observe(area.word);
  });
  scene.outcomes(1U << 1U | 1U << 2U);
}

// As a flag that one task has set, and another one resets: the value is that of the beginning again.
void one_resets_what_another_one_sets(Scene& scene) {
  set_up(scene);
  plchost_take_places(&plchost_tasks[kLow]);
  assign(1);
  scene.thread("low", [] { plchost_put_places(&plchost_tasks[kLow]); }, kOnTheCore);
  scene.thread(
      "high",
      [] {
        cycle(kHigh, [] { assign(0); });
        cycle(kHigh);
        require(word_now() == 0, "an assigned value is undone");
      },
      kOnTheCore);
  scene.at_end([] {
    require(program.word == 0, "an assigned value is undone");
    require(area.word == 0, "the area has not the value that was assigned last");
  });
}

void firmware_writes_and_nobody_assigns(Scene& scene) {
  set_up(scene);
  scene.thread("low", [] { cycle(kLow); }, kOnTheCore);
  scene.thread("high", [] { cycle(kHigh); }, kOnTheCore);
  scene.thread(
      "firmware",
      [] {
        write_by_firmware(1);
        write_by_firmware(2);
      },
      kOnTheCore);
  scene.at_end([] {
    require(area.word == 2, "a value of the firmware is undone");
    require_one_value();
    require(area.word == 2, "a value of the firmware is undone");
  });
}

// A task ends a cycle that it has begun two values ago.
void firmware_writes_in_a_long_cycle(Scene& scene) {
  set_up(scene);
  plchost_take_places(&plchost_tasks[kLow]);
  write_by_firmware(1);
  cycle(kHigh);
  require(word_now() == 1, "a task does not take the value of the firmware");
  write_by_firmware(2);
  scene.thread("low", [] { plchost_put_places(&plchost_tasks[kLow]); }, kOnTheCore);
  scene.thread("high", [] { cycle(kHigh); }, kOnTheCore);
  scene.thread("firmware", [] { write_by_firmware(3); }, kOnTheCore);
  scene.at_end([] {
    require(area.word == 3, "a value of the firmware is undone");
    require_one_value();
    require(area.word == 3, "a value of the firmware is undone");
  });
}

void firmware_writes_and_one_assigns(Scene& scene) {
  set_up(scene);
  auto& replaced = scene.make<unsigned>();
  scene.thread("low", [] { cycle(kLow, [] { assign(5); }); }, kOnTheCore);
  scene.thread("high", [] { cycle(kHigh); }, kOnTheCore);
  scene.thread(
      "firmware", [&] { replaced = __atomic_exchange_n(&area.word, 1, __ATOMIC_RELAXED); }, kOnTheCore);
  scene.at_end([&] {
    require_one_value();
    require(area.word == 5 || replaced == 5, "an assigned value is undone");
    require(area.word == 5 || area.word == 1, "a value that nobody has written");
    observe(area.word);
  });
  scene.outcomes(1U << 1U | 1U << 5U);
}

void bits_of_one_byte(Scene& scene) {
  set_up(scene);
  scene.thread("first",
               [] { cycle(kFirstBit, [] { __atomic_store_n(&program.first, 1, __ATOMIC_RELAXED); }); });
  scene.thread("second",
               [] { cycle(kSecondBit, [] { __atomic_store_n(&program.second, 1, __ATOMIC_RELAXED); }); });
  scene.thread("firmware", [] { __atomic_fetch_or(&area.bits, 4, __ATOMIC_RELAXED); }, kOnTheCore);
  scene.at_end([] { require(area.bits == 7, "a bit is lost"); });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"firmware_writes_in_a_long_cycle", firmware_writes_in_a_long_cycle},
              {"one_resets_what_another_one_sets", one_resets_what_another_one_sets},
              {"bits_of_one_byte", bits_of_one_byte},
              {"two_tasks_assign", two_tasks_assign},
              {"firmware_writes_and_nobody_assigns", firmware_writes_and_nobody_assigns},
              {"firmware_writes_and_one_assigns", firmware_writes_and_one_assigns}});
}
