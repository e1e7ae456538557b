#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/block_driver/block.hpp"
#include "tests/bench/blocks_pipe.hpp"

namespace plchost::bench {

/// One direction of the floor: a memcpy into a ring of as many bytes as a queue of ours has, and one out of
/// it.
struct BareRing {
  static constexpr std::size_t kMessages = 4;
  alignas(64) std::atomic<std::uint64_t> sent{0};
  alignas(64) std::atomic<std::uint64_t> taken{0};
  std::array<std::uint64_t, kMessages> sizes{};
  alignas(64) std::array<std::array<std::byte, kMaxBlockSize>, kMessages> bytes{};
};

/// Non-blocking, over one end of a pair of datagram sockets, which outlives it.
std::unique_ptr<BlocksPipe> make_socket_pipe(int fd);
/// Bare memcpy: the limit between the two cores.
std::unique_ptr<BlocksPipe> make_bare_pipe(BareRing& out, BareRing& in);
/// CmpBlkDrvShm: a node with its router's thread. Returns when the links to the other side are there.
Result<std::unique_ptr<BlocksPipe>> make_our_pipe(const std::string& pool, BlocksSide side);

/// While the other process sets something up.
void pause_for(Duration duration);

}  // namespace plchost::bench
