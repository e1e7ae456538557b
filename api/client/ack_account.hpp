#pragma once

#include <cstdint>
#include <string>

#include <control.h>

#include "shm/base/result.hpp"

namespace plchost {

/// The results of posts.
struct PostReport {
  std::uint64_t accepted = 0;  ///< counted by the event (no_task included)
  std::uint64_t no_task = 0;   ///< counted, but no task was bound to the event at that time
  std::uint64_t rejected = 0;  ///< not counted
  ErrorCode rejected_code = ErrorCode::ok;
  std::uint64_t lost = 0;            ///< not counted: one-way posts that never came
  std::string rejected_text;         ///< why the last rejected one was
  std::uint64_t unacknowledged = 0;  ///< nothing is known of these; 0 unless the host stopped answering
};

/// The counts in the acknowledgements of one source. The host's ledger of posts may begin anew (it is made
/// anew for a new pool, and forgets the source that posted least recently): it counts from 0 then.
class AckAccount {
 public:
  /// Sums since the account was made.
  struct Sums {
    std::uint64_t accepted = 0;
    std::uint64_t no_task = 0;
    std::uint64_t rejected = 0;
    std::uint64_t lost = 0;
  };
  /// An acknowledgement that is not older than the one before.
  void take(const plc_EventAck& ack);
  [[nodiscard]] Sums sums() const noexcept;
  /// From now on report() is about the posts from this number on. Acknowledgements of earlier posts may still
  /// come: of posts that were given up, or that no caller waited for.
  void begin(std::uint64_t first) noexcept;
  [[nodiscard]] PostReport report() const;
  /// Its epoch is 0: none yet.
  [[nodiscard]] const plc_EventAck& newest() const noexcept { return newest_; }

 private:
  [[nodiscard]] Sums since_base() const noexcept;
  [[nodiscard]] Sums earlier_part(std::uint64_t before) const noexcept;

  Sums earlier_;             // of the ledgers before this one
  Sums base_;                // of the posts before first_
  std::uint64_t first_ = 1;  // post of the report
  plc_EventAck newest_{};
  std::uint64_t last_rejected_ = 0;  // of all ledgers
  ErrorCode rejected_code_ = ErrorCode::ok;
  std::string rejected_text_;
};

}  // namespace plchost
