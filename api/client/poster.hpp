#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <contract_bounds.hpp>
#include <control.h>

#include "api/client/ack_account.hpp"
#include "api/client/host_clock.hpp"
#include "api/client/met_readers.hpp"
#include "api/client/newest_epoch.hpp"
#include "api/dds/guid.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// An external event by its two names.
struct EventId {
  std::string instance;
  std::string event;
};

/// An external event of a host.
struct HostEvent {
  std::string host;
  std::string instance;
  std::string event;

  [[nodiscard]] EventId id() const { return {instance, event}; }
};

/// How many events a batch may have.
inline constexpr std::size_t kMaxBatch = dds::bounds::EventBatch::events;

/// The posts of one topic to one host: numbers them, keeps those that are not acknowledged, and repeats them.
/// A plc_EventPost has one event, a plc_EventBatch one or more.
template <class Sample>
class Poster {
 public:
  /// Unacknowledged posts at most.
  static constexpr std::size_t kWindow = 32;
  /// Repeats after so long without progress. It repeats sooner while DDS has no room for a post, and while
  /// the server that was found last has not acknowledged anything yet. That server may not have found this
  /// writer.
  static constexpr Duration kResend = std::chrono::milliseconds(200);
  static constexpr Duration kFirstResend = std::chrono::milliseconds(20);

  /// `topic` is that of Sample.
  [[nodiscard]] static Result<Poster> create(dds_entity_t participant, dds_entity_t topic,
                                             const std::string& host);

  [[nodiscard]] const dds::Guid& source() const noexcept { return source_; }
  [[nodiscard]] dds_entity_t writer() const noexcept { return way_.writer.get(); }
  /// Whether the host's reader is there.
  [[nodiscard]] bool matched() const noexcept { return has_reader(way_.writer.get()); }

  /// How long posts are waited for, after the last progress, and the host's clock as it is known now: the
  /// host rejects a post that it comes to later. To be called before posts and whenever the clock may have
  /// changed.
  void wait_for(Duration patience, const HostClock& clock) noexcept;

  /// One post that is repeated until it is acknowledged. Only while has_room(). `events`: as many as a Sample
  /// may have, whose names fit. `awaited`: the host shall tell when it was run. Returns its number.
  std::uint64_t post(std::span<const EventId> events, TimePoint now, bool awaited = false);
  std::uint64_t post(const EventId& event, TimePoint now, bool awaited = false) {
    return post(std::span(&event, 1), now, awaited);
  }
  /// The same post again, which was acknowledged: the host that is there now shall tell when it was run.
  void ask_again(std::uint64_t number, const EventId& event);
  [[nodiscard]] bool has_room() const noexcept { return unacknowledged_.size() < window_; }
  [[nodiscard]] std::size_t unacknowledged() const noexcept { return unacknowledged_.size(); }

  /// One post that is not repeated, and whose acknowledgement is not awaited: as fast as DDS is. One call
  /// of dds_write. The host rejects it after `limit`.
  [[nodiscard]] Result<void> post_once(std::string_view instance, std::string_view event,
                                       const plc_TimeLimit& limit) noexcept
    requires std::same_as<Sample, plc_EventPost>;

  /// Returns true if that acknowledged something.
  bool on_ack(const plc_EventAck& ack, TimePoint now);
  /// Repeats what is due to be repeated: all when a server is new, else only the oldest until the host
  /// answers. More would fill the writer, which keeps what a killed server has not confirmed. Returns when it
  /// has to be called again.
  TimePoint repeat(TimePoint now);
  [[nodiscard]] TimePoint last_progress() const noexcept { return last_progress_; }
  /// From now on report() is about the posts that follow, and nothing before is repeated.
  void begin_report(TimePoint now);
  /// Counts posts, whatever number of events each has.
  [[nodiscard]] PostReport report() const;

 private:
  Poster() = default;
  dds_return_t write(std::uint64_t sequence) noexcept;

  struct Unacknowledged {
    std::uint64_t sequence = 0;
    std::vector<plc_EventName> events;
    bool awaited = false;
  };
  [[nodiscard]] static std::vector<plc_EventName> names_of(std::span<const EventId> events);
  dds_return_t write(Unacknowledged& post) noexcept;
  /// Whether there is a server that was not there at the last call.
  bool has_met_server() noexcept;
  [[nodiscard]] Duration patience_until_repeated() const noexcept;

  dds::PartitionWriter way_;  // to the host
  Sample sample_{};           // all but numbers and events is set once
  dds::Guid source_;
  std::deque<Unacknowledged> unacknowledged_;
  std::size_t window_ = kWindow;
  Duration patience_{};
  HostClock clock_;
  std::uint64_t last_sequence_ = 0;
  TimePoint last_progress_;
  TimePoint last_write_;
  NewestEpoch epoch_;
  bool answered_ = false;  // since the last write
  bool heard_ = false;     // of the server that was met last
  bool has_space_ = true;  // DDS had for the last post
  MetReaders met_;
  AckAccount account_;
};

extern template class Poster<plc_EventPost>;
extern template class Poster<plc_EventBatch>;

using EventPoster = Poster<plc_EventPost>;
using BatchPoster = Poster<plc_EventBatch>;

}  // namespace plchost
