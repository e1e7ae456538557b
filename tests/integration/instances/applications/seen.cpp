// A program whose variables are seen, written and forced from outside. VERSION=2: another version of it.
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>

#include "../../../../instances/plc_app.hpp"

using namespace std::chrono_literals;

#ifndef VERSION
#define VERSION 1
#endif

namespace {

// Each in its own task, so that no two tasks write one of them.
struct Pair {
  std::uint64_t first = 0;
  std::uint64_t second = 0;
};

Pair fast;
Pair slow;
std::uint32_t count = 0;
std::int16_t input = 3;
std::int16_t output = 0;
std::int16_t forced = 1;
std::int16_t at_begin = 0;
std::int16_t behind_call = 0;
std::int32_t written = 0;
std::int32_t taken = 0;
bool crash = false;
std::atomic<bool> flag{true};
float real = 1.5F;
double lreal = -2.0;
std::chrono::nanoseconds pause = 1500ms;
char text[11] = "hello";
std::array<float, 10> temperature{};
int grid[2][3] = {{1, 2, 3}, {4, 5, 6}};
const std::uint16_t serial = 4711;
#if VERSION == 1
std::int16_t changed = 1;
#else
std::int32_t changed = 2;
#endif
std::int16_t version = VERSION;
std::uint16_t status = 0x00ff;
short pressure[3] = {7, 8, 9};
char label[8] = "press";
char letter = 'a';
std::atomic<char16_t> sign{u'\u20ac'};
char16_t title[8] = u"gr\u00fc\u00df";
std::array<std::array<char16_t, 4>, 2> units{{{u'k', u'g'}, {u'\u00b5', u'm'}}};

// The compiler keeps neither out of the other's place.
void move(std::uint64_t& to, std::uint64_t value) {
  *const_cast<volatile std::uint64_t*>(&to) = value;
}

void spin(std::chrono::nanoseconds length) {
  const auto end = std::chrono::steady_clock::now() + length;
  while (std::chrono::steady_clock::now() < end) continue;
}

void main_cycle() {
  ++count;
  at_begin = forced;
  forced = 7;
  plc_apply_forces();
  behind_call = forced;
  forced = 8;
  output = input;
  input = 3;
  taken += written;
  written = 0;
  if (crash) *static_cast<volatile int*>(nullptr) = 1;
  move(fast.first, fast.first + 1);
  move(fast.second, fast.second + 1);
}

// Main interrupts it.
void slow_cycle() {
  move(slow.first, slow.first + 1);
  spin(3ms);
  move(slow.second, slow.second + 1);
}

void setup(plc::Application& app) {
  app.cyclic("Main", 1, 2ms, main_cycle);
  app.cyclic("Slow", 20, 20ms, slow_cycle);
  app.variable("Fast.first", fast.first, {"Main"});
  app.variable("Fast.second", fast.second, {"Main"});
  app.variable("Slow.first", slow.first);
  app.variable("Slow.second", slow.second);
  app.variable("Main.count", count);
  app.variable("Main.input", input, {"Main", "%IW0"});
  app.variable("Main.output", output, {"Main"});
  app.variable("Main.forced", forced, {"Main"});
  app.variable("Main.at_begin", at_begin);
  app.variable("Main.behind_call", behind_call);
  app.variable("Main.written", written);
  app.variable("Main.taken", taken);
  app.variable("Main.crash", crash);
  app.variable("Main.flag", flag);
  app.variable("Main.real", real);
  app.variable("Main.lreal", lreal);
  app.variable("Main.pause", pause);
  app.variable("Main.text", text);
  plc::VariableOptions from_one;
  from_one.first = 1;
  app.variable("Line.temperature", temperature, from_one);
  app.variable("Grid", grid);
  app.variable("Main.serial", serial);
  app.variable("Main.changed", changed);
  app.variable("Main.version", version);
  plc::VariableOptions word;
  word.type = PLC_TYPE_WORD;
  app.variable("Main.status", status, word);
  PLC_DECLARE_ARRAY("Line.pressure[]", PLC_TYPE_INT, pressure, 1);
  PLC_DECLARE_STRING("Line.label", label);
  app.variable("Main.letter", letter);
  app.variable("Main.sign", sign);
  app.variable("Line.title", title);
  app.variable("Line.units", units, from_one);
}

}  // namespace

PLC_APPLICATION("Seen", setup)
