// core_witness CORE INTERVAL_US: for each line of its input, how many cycles of that interval the core has
// taken so far.
#include "tests/support/core_witness.hpp"

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <span>
#include <string>

int main(int count, char** words) {
  const std::span arguments(words, static_cast<std::size_t>(count));
  const long long interval = arguments.size() == 3 ? std::atoll(arguments[2]) : 0;
  if (interval <= 0) return EXIT_FAILURE;
  const plchost::CoreWitness witness(std::atoi(arguments[1]), std::chrono::microseconds(interval));
  for (std::string line; std::getline(std::cin, line);) std::cout << witness.taken() << std::endl;
}
