#pragma once

#include <cerrno>
#include <cstdlib>
#include <new>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <sys/mman.h>

#include "shm/base/result.hpp"
#include "shm/files/memory_file.hpp"
#include "tests/bench/dds_board.hpp"
#include "tests/bench/processes.hpp"
#include "tests/bench/row.hpp"
#include "tests/bench/shared_board.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::bench {

/// Measures beside processes of this program that share a `Board` with it: `fork(processes, board)` makes
/// them, before this process has any thread of DDS; then `measure(board)`.
template <class Board, class Fork, class Measure>
[[nodiscard]] Result<std::vector<Row>> measure_beside(Fork fork, Measure measure) {
  void* const memory =
      ::mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return failure(ErrorCode::system, "map the board", errno);
  Board& board = *new (memory) Board{};
  // The stamps of the program in the instance are not looked at here, but it wants a place for them.
  const std::string stamps = own_name("board");
  PLCHOST_TRY(MemoryFile::replace(stamps, sizeof(DdsBoard)));
  ::setenv(kBoardVariable, ("/dev/shm/" + stamps).c_str(), 1);
  Result<std::vector<Row>> rows;
  {
    Processes processes;
    fork(processes, board);
    rows = measure(board);
  }
  MemoryFile::remove(stamps);
  ::munmap(memory, sizeof(Board));
  return rows;
}

}  // namespace plchost::bench
