// modbus_terminal: a Modbus device on TCP. It prints its port, and then obeys lines of standard input:
//
//     normal, stalls, garbage, refuses, echoes   set how it answers
//     holding N                                  prints a register
//     away, back                                 end it for its clients, and bring it back
//
// It ends with its standard input.

#include <iostream>
#include <memory>
#include <string>

#include "tests/integration/modbus/modbus_peer.hpp"

int main() {
  using namespace plchost::testing;
  const HeldPort port;
  auto mode = ModbusPeer::Mode::echoes;
  auto peer = std::make_unique<ModbusPeer>(port, mode);
  std::cout << port.number() << std::endl;  // NOLINT(performance-avoid-endl): a program reads it now
  std::string word;
  while (std::cin >> word) {
    if (word == "holding") {
      int address = 0;
      std::cin >> address;
      std::cout << (peer && address >= 0 && address < ModbusPeer::kRegisters ? peer->holding(address) : -1)
                << std::endl;
      continue;
    }
    if (word == "away") {
      peer.reset();
      continue;
    }
    if (word == "stalls") mode = ModbusPeer::Mode::stalls;
    if (word == "garbage") mode = ModbusPeer::Mode::garbage;
    if (word == "refuses") mode = ModbusPeer::Mode::refuses;
    if (word == "normal") mode = ModbusPeer::Mode::normal;
    if (word == "echoes") mode = ModbusPeer::Mode::echoes;
    if (!peer) peer = std::make_unique<ModbusPeer>(port, mode);
    peer->set(mode);
  }
  return 0;
}
