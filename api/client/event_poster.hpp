#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

#include <control.h>

#include "api/client/host_clock.hpp"
#include "api/client/newest_epoch.hpp"
#include "api/dds/entity.hpp"
#include "api/dds/guid.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

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
  [[nodiscard]] PostReport report_since(const Sums& base) const;
  /// Its epoch is 0: none yet.
  [[nodiscard]] const plc_EventAck& newest() const noexcept { return newest_; }

 private:
  Sums earlier_;  // of the ledgers before this one
  plc_EventAck newest_{};
  ErrorCode rejected_code_ = ErrorCode::ok;
  std::string rejected_text_;
};
/// Whether a writer has met a reader.
[[nodiscard]] bool has_reader(dds_entity_t writer) noexcept;
/// How many readers a writer has met so far, those that are gone included.
[[nodiscard]] std::uint32_t readers_met(dds_entity_t writer) noexcept;

/// The posts to one host: numbers them, keeps those that are not acknowledged, and repeats them.
class EventPoster {
 public:
  /// Unacknowledged posts at most.
  static constexpr std::size_t kWindow = 32;
  /// Repeats after so long without progress. It repeats sooner while DDS has no room for a post, and while
  /// the server that was found last has not acknowledged anything yet: that may not have found this writer.
  static constexpr Duration kResend = std::chrono::milliseconds(200);
  static constexpr Duration kFirstResend = std::chrono::milliseconds(20);

  [[nodiscard]] static Result<EventPoster> create(dds_entity_t participant, dds_entity_t topic,
                                                  const std::string& host);

  [[nodiscard]] const dds::Guid& source() const noexcept { return source_; }
  [[nodiscard]] dds_entity_t writer() const noexcept { return writer_.get(); }
  /// Whether the host's reader is there.
  [[nodiscard]] bool matched() const noexcept { return has_reader(writer_.get()); }

  /// How long posts are waited for, after the last progress, and the host's clock as it is known now: the
  /// host rejects a post that it comes to later. To be called before posts and whenever the clock may have
  /// changed.
  void wait_for(Duration patience, const HostClock& clock) noexcept;

  /// One post that is repeated until it is acknowledged. Only while has_room(). `awaited`: the host shall
  /// tell when it was run. Returns its number.
  std::uint64_t post(std::string_view instance, std::string_view event, TimePoint now, bool awaited = false);
  /// The same post again, which was acknowledged: the host that is there now shall tell when it was run.
  void ask_again(std::uint64_t number, std::string_view instance, std::string_view event);
  [[nodiscard]] bool has_room() const noexcept { return unacknowledged_.size() < window_; }
  [[nodiscard]] std::size_t unacknowledged() const noexcept { return unacknowledged_.size(); }

  /// One post that is not repeated, and whose acknowledgement nobody waits for: as fast as DDS is. One call
  /// of dds_write.
  [[nodiscard]] Result<void> post_once(std::string_view instance, std::string_view event) noexcept;

  /// Returns true if that acknowledged something.
  bool on_ack(const plc_EventAck& ack, TimePoint now);
  /// Repeats what is due to be repeated: all when a server is new, else only the oldest until the host
  /// answers. More would fill the writer, which keeps what a killed server has not confirmed. Returns when it
  /// has to be called again.
  TimePoint repeat(TimePoint now);
  [[nodiscard]] TimePoint last_progress() const noexcept { return last_progress_; }
  /// From now on report() counts from 0, and nothing before is repeated.
  void begin_report(TimePoint now);
  [[nodiscard]] PostReport report() const;

 private:
  EventPoster() = default;
  dds_return_t write(std::uint64_t sequence) noexcept;

  struct Unacknowledged {
    std::uint64_t sequence = 0;
    std::string instance;
    std::string event;
    bool awaited = false;
  };
  dds_return_t write(const Unacknowledged& post) noexcept;
  /// Whether there is a server that was not there at the last call.
  bool has_met_server() noexcept;
  [[nodiscard]] Duration patience_until_repeated() const noexcept;

  dds::Entity publisher_;
  dds::Entity writer_;
  plc_EventPost sample_{};  // all but numbers and names is set once
  dds::Guid source_;
  std::deque<Unacknowledged> unacknowledged_;
  std::size_t window_ = kWindow;
  Duration patience_{};
  HostClock clock_;
  std::uint64_t last_sequence_ = 0;
  TimePoint last_progress_;
  TimePoint last_write_;
  NewestEpoch epoch_;
  bool answered_ = false;          // since the last write
  bool heard_ = false;             // of the server that was met last
  bool has_space_ = true;          // DDS had for the last post
  std::uint32_t readers_met_ = 0;  // at the last has_met_server()
  AckAccount account_;
  AckAccount::Sums base_;  // where the report counts from
};

}  // namespace plchost
