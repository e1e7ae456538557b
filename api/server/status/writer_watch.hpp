#pragma once

#include <cstdint>
#include <string>

#include <control.h>

#include "api/server/clients/session_table.hpp"
#include "api/server/posts/event_intake.hpp"
#include "api/server/status/status_table.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Shows what became of the posts of each client's writer. Control loop only.
class WriterWatch {
 public:
  static constexpr Duration kPeriod = std::chrono::milliseconds(200);
  /// A writer whose client is gone is shown for so long after its last post.
  static constexpr Duration kKept = std::chrono::minutes(1);
  /// Of more that are gone, those that posted last.
  static constexpr std::size_t kMostGone = 64;

  WriterWatch() = default;
  explicit WriterWatch(StatusTable<plc_WriterStatus>& table) : table_(&table) {}

  /// Looks if it is time to. Returns true if something has changed.
  bool look(const EventIntake& intake, const SessionTable& sessions, TimePoint now);

 private:
  StatusTable<plc_WriterStatus>* table_ = nullptr;
  Duration to_unix_{unix_time_ns() - MonotonicClock::now().time_since_epoch().count()};
  TimePoint next_look_;
};

}  // namespace plchost
