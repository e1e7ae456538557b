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
// * If two tasks and firmware each set a bit of one byte, all three are set. A task that has the byte changes
//   no other bit than those that it assigns.
// * The bits of one byte in a task's places are the same in all of them, and go to the firmware once.
// * No value goes out that a task has in the midst of its cycle.

#include <array>
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
  unsigned char byte;
};
Program program;

struct alignas(8) Area {
  unsigned char bits;
  unsigned char unused[3];
  unsigned word;
};
Area area;

plchost_use use_of(unsigned place, void* value, unsigned next = 0) {
  plchost_use use{};
  use.place = place;
  use.value = value;
  use.next = next;
  return use;
}
plchost_use low_word = use_of(0, &program.word);
plchost_use high_word = low_word;
plchost_use first_bit = use_of(1, &program.first);
plchost_use second_bit = use_of(2, &program.second);
plchost_use byte_alone = use_of(3, &program.byte);
// They share bits, the widest one first.
std::array low_bits{use_of(3, &program.byte, 1), use_of(1, &program.first, 0)};
std::array high_bits = low_bits;

plchost_task task_that_has(const char* name, plchost_use* uses, unsigned count = 1) {
  plchost_task task{};
  task.name = name;
  task.uses_count = count;
  task.uses = uses;
  task.sharing_count = count == 1 ? 0 : count;
  return task;
}

}  // namespace

// The file that plcctl writes.
extern "C" {
const unsigned int plchost_place_count = 4;
const plchost_place plchost_places[] = {{"__MD1", 'M', 4, -1, 0, 4, &program.word},
                                        {"__MX0_0", 'M', 1, 0, 1, 0, &program.first},
                                        {"__MX0_1", 'M', 1, 1, 1, 0, &program.second},
                                        {"__MB0", 'M', 1, -1, 1, 0, &program.byte}};
unsigned long long plchost_exchanged[4];
const unsigned int plchost_location_count = 0;
const plchost_location plchost_locations[] = {{"", 0}};
const unsigned int plchost_task_count = 7;
const plchost_task plchost_tasks[] = {task_that_has("low", &low_word),
                                      task_that_has("high", &high_word),
                                      task_that_has("first bit", &first_bit),
                                      task_that_has("second bit", &second_bit),
                                      task_that_has("byte", &byte_alone),
                                      task_that_has("low bits", low_bits.data(), 2),
                                      task_that_has("high bits", high_bits.data(), 2)};

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
int plchost_is_stopped(unsigned /*task*/) {
  return 0;
}
}

namespace plchost::models {
namespace {

enum Task : unsigned { kLow, kHigh, kFirstBit, kSecondBit, kByte, kLowBits, kHighBits };

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
  plchost_forget_places();
  for (auto* const bits : {&low_bits, &high_bits}) {
    for (plchost_use& use : *bits) use.seen = 0;
  }
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

template <class T>
T now(const T& value) {
  return __atomic_load_n(&value, __ATOMIC_RELAXED);
}
void assign_bits(Task task, unsigned char& variable, unsigned char value) {
  plchost_assign_place(&plchost_tasks[task], &variable, &value);
}

void a_bit_beside_its_byte(Scene& scene) {
  set_up(scene);
  scene.thread(
      "byte",
      [] {
        cycle(kByte, [] {
          __atomic_store_n(&program.byte, static_cast<unsigned char>(now(program.byte) ^ 0x80U),
                           __ATOMIC_RELAXED);
        });
      },
      kOnTheCore);
  scene.thread(
      "first", [] { cycle(kFirstBit, [] { __atomic_store_n(&program.first, 1, __ATOMIC_RELAXED); }); },
      kOnTheCore);
  scene.thread("firmware", [] { __atomic_fetch_or(&area.bits, 4, __ATOMIC_RELAXED); }, kOnTheCore);
  scene.at_end([] {
    require(area.bits == 0x85, "a bit is lost");
    cycle(kByte);
    cycle(kFirstBit);
    require(area.bits == 0x85 && program.byte == 0x85 && program.first == 1, "a bit is undone");
  });
}

// Both have the byte and its first bit.
void two_tasks_assign_shared_bits(Scene& scene) {
  set_up(scene);
  scene.thread("low", [] { assign_bits(kLowBits, program.first, 1); }, kOnTheCore);
  scene.thread("high", [] { assign_bits(kHighBits, program.first, 0); }, kOnTheCore);
  scene.at_end([] {
    require(program.first == (program.byte & 1U), "places that share bits have two values");
    observe(program.first);
  });
  scene.outcomes(1U << 0U | 1U << 1U);
}

void two_tasks_put_shared_bits(Scene& scene) {
  set_up(scene);
  plchost_take_places(&plchost_tasks[kLowBits]);
  assign_bits(kLowBits, program.byte, 0x80);
  scene.thread("low", [] { plchost_put_places(&plchost_tasks[kLowBits]); }, kOnTheCore);
  scene.thread(
      "high", [] { cycle(kHighBits, [] { assign_bits(kHighBits, program.first, 1); }); }, kOnTheCore);
  scene.at_end([] {
    require(program.first == 1 && program.byte == 0x81, "an assigned value is undone");
    require(area.bits == 0x81, "the area has not the value that was assigned last");
  });
}

// A request that the firmware resets when it sees it.
void firmware_resets_a_bit(Scene& scene) {
  set_up(scene);
  auto& seen = scene.make<unsigned>();
  scene.thread("low", [] { cycle(kLowBits, [] { assign_bits(kLowBits, program.first, 1); }); }, kOnTheCore);
  scene.thread(
      "firmware",
      [&] { seen += __atomic_fetch_and(&area.bits, static_cast<unsigned char>(~1U), __ATOMIC_RELAXED) & 1U; },
      kOnTheCore);
  scene.at_end([&] {
    cycle(kLowBits);
    cycle(kFirstBit);
    require((area.bits & 1U) != seen, "a value of the firmware is undone");
    require(program.first == (area.bits & 1U), "the program and the area have two values");
    require(program.first == (program.byte & 1U), "places that share bits have two values");
    observe(seen);
  });
  scene.outcomes(1U << 0U | 1U << 1U);
}

void a_value_within_a_cycle(Scene& scene) {
  set_up(scene);
  plchost_take_places(&plchost_tasks[kLow]);
  assign(97);
  scene.thread(
      "high",
      [] {
        cycle(kHigh);
        require(now(area.word) != 97, "a value within a cycle goes out");
      },
      kOnTheCore);
  scene.thread("firmware", [] { write_by_firmware(5); }, kOnTheCore);
  scene.at_end([] {
    assign(100);
    plchost_put_places(&plchost_tasks[kLow]);
    require(area.word == 100, "the area has not the value that was assigned last");
  });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"firmware_writes_in_a_long_cycle", firmware_writes_in_a_long_cycle},
              {"one_resets_what_another_one_sets", one_resets_what_another_one_sets},
              {"bits_of_one_byte", bits_of_one_byte},
              {"a_bit_beside_its_byte", a_bit_beside_its_byte},
              {"two_tasks_assign_shared_bits", two_tasks_assign_shared_bits},
              {"two_tasks_put_shared_bits", two_tasks_put_shared_bits},
              {"firmware_resets_a_bit", firmware_resets_a_bit},
              {"a_value_within_a_cycle", a_value_within_a_cycle},
              {"two_tasks_assign", two_tasks_assign},
              {"firmware_writes_and_nobody_assigns", firmware_writes_and_nobody_assigns},
              {"firmware_writes_and_one_assigns", firmware_writes_and_one_assigns}});
}
