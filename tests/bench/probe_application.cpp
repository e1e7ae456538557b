// Runs in a real instance: stamps the first instruction of the task that an external event activates.

#include <cstdlib>
#include <stdexcept>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "instances/plc_app.hpp"
#include "shm/base/time.hpp"
#include "tests/bench/dds_board.hpp"

namespace {

using plchost::bench::DdsBoard;

DdsBoard& open_board() {
  const char* name = std::getenv(plchost::bench::kBoardVariable);
  const int fd = name == nullptr ? -1 : ::open(name, O_RDWR | O_CLOEXEC);
  if (fd < 0) throw std::runtime_error("no board for the benchmark");
  void* memory = ::mmap(nullptr, sizeof(DdsBoard), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  ::close(fd);
  if (memory == MAP_FAILED) throw std::runtime_error("the board cannot be mapped");
  return *static_cast<DdsBoard*>(memory);
}

void setup(plc::Application& app) {
  DdsBoard& board = open_board();
  app.external("Ping", 0, "ping",
               [&board] { board.record(plchost::MonotonicClock::now().time_since_epoch().count()); });
}

}  // namespace

PLC_APPLICATION("BenchProbe", setup)
