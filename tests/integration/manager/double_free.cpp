// An application whose task frees a block twice: it aborts with the lock of the heap that the control thread
// allocates from.

#include <array>
#include <cstdlib>

#include "instances/plc_app.hpp"

static void setup(plc::Application& app) {
  using namespace std::chrono_literals;
  // Large enough that each free goes to the heap, made here for the main thread's heap.
  static std::array<void* volatile, 4> blocks;
  for (auto& block : blocks) block = std::malloc(3000);
  app.cyclic("DoubleFree", 5, 10ms, [] {
    for (const std::size_t i : {1U, 3U, 1U}) std::free(blocks[i]);
  });
}
PLC_APPLICATION("DoubleFree", setup)
