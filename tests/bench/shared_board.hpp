#pragma once

#include <cstdlib>
#include <stdexcept>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace plchost::bench {

/// The environment variable that names the file of the memory which the benchmark shares with a program.
inline constexpr const char* kBoardVariable = "PLCHOST_BENCH_BOARD";

/// In the program: maps that memory, for good. Throws where there is none.
template <class Board>
Board& open_board() {
  const char* name = std::getenv(kBoardVariable);
  const int fd = name == nullptr ? -1 : ::open(name, O_RDWR | O_CLOEXEC);
  if (fd < 0) throw std::runtime_error("no board for the benchmark");
  void* memory = ::mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  ::close(fd);
  if (memory == MAP_FAILED) throw std::runtime_error("the board cannot be mapped");
  return *static_cast<Board*>(memory);
}

}  // namespace plchost::bench
