// Tasks of external events that count their runs in a file of the test: "e0" is the first number in it, and
// so on.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "instances/plc_app.hpp"

namespace {

constexpr std::size_t kEvents = 32;

std::atomic<std::uint64_t>* map_runs() {
  const char* const path = std::getenv("COUNTED_RUNS");
  const int file = path != nullptr ? ::open(path, O_RDWR | O_CLOEXEC) : -1;
  void* const memory =
      ::mmap(nullptr, kEvents * sizeof(std::uint64_t), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  return memory == MAP_FAILED ? nullptr : static_cast<std::atomic<std::uint64_t>*>(memory);
}

void setup(plc::Application& app) {
  using namespace std::chrono_literals;
  static std::atomic<std::uint64_t>* const runs = map_runs();
  app.cyclic("Main", 1, 2ms, [] {});
  for (std::size_t i = 0; i < kEvents; ++i) {
    const std::string number = std::to_string(i);
    app.external("Count" + number, 5, "e" + number, [i] {
      if (runs != nullptr) runs[i].fetch_add(1);
    });
  }
}

}  // namespace

PLC_APPLICATION("CountedRuns", setup)
