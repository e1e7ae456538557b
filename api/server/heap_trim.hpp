#pragma once

#include <cstdint>

#include "shm/base/time.hpp"

namespace plchost {

/// Blocks of 128 KiB and more get pages of their own, which go back to the system when they are freed. That
/// is malloc's default, but malloc gives it up at the first such block that is freed. From then on Cyclone's
/// receive buffers, of 256 KiB each, lie among the small blocks of its clients. The next buffer does not fit
/// into what the last one has left, because small blocks that stay have taken a part of it, and the heap
/// grows. With one arena for all threads it grows no less, and threads of different priorities would wait for
/// one lock. Before the first thread.
void give_large_blocks_back() noexcept;

/// Gives the memory back to the system that clients have left free. malloc keeps it in pieces between what is
/// still used: after thousands of clients some megabytes. That takes malloc's locks for some milliseconds, so
/// it is done only while the server has nothing else to do. Control loop only.
class HeapTrim {
 public:
  /// Worth it after so many pieces of work.
  static constexpr std::uint64_t kWorth = 64;
  /// No client has come, gone, asked or posted for so long.
  static constexpr Duration kQuiet = std::chrono::seconds(2);

  /// So many clients have asked, posted, come or gone since the last call.
  void worked(std::uint64_t clients, TimePoint now) noexcept;
  /// Returns true if it was done.
  bool look(TimePoint now) noexcept;

 private:
  std::uint64_t work_ = 0;  // since it was done
  TimePoint last_work_;
};

}  // namespace plchost
