#pragma once

#include <cstdint>

#include "shm/base/time.hpp"

namespace plchost {

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
