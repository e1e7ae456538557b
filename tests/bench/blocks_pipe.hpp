#pragma once

// C++17, in which iceoryx's headers are read.
#include <cstddef>
#include <memory>
#include <string>

namespace plchost::bench {

/// One end of a way between two processes, for messages of at most 64 KiB, both ways. Nothing waits in it.
class BlocksPipe {
 public:
  BlocksPipe() = default;
  virtual ~BlocksPipe() = default;
  BlocksPipe(const BlocksPipe&) = delete;
  BlocksPipe& operator=(const BlocksPipe&) = delete;
  /// Copies it in. false: no room now.
  virtual bool send(const void* data, std::size_t size) = 0;
  /// Copies it out, and the size of it; 0: nothing there.
  virtual std::size_t receive(void* buffer, std::size_t size) = 0;
};

/// How the two ends are called.
enum class BlocksSide { bench, peer };

/// iceoryx 2.0 with a RouDi that runs already: loan, copy in, publish; take, copy out. Null: it was not
/// installed when this was built. `pool` makes names unique.
std::unique_ptr<BlocksPipe> make_iceoryx_pipe(const std::string& pool, BlocksSide side);
bool has_iceoryx() noexcept;

}  // namespace plchost::bench
