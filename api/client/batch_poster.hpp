#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <control.h>

#include "api/client/event_poster.hpp"
#include "api/client/host_clock.hpp"
#include "api/client/newest_epoch.hpp"
#include "api/dds/entity.hpp"
#include "api/dds/guid.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// An external event by its two names.
struct EventId {
  std::string instance;
  std::string event;
};

/// How many events a batch may have.
inline constexpr std::size_t kMaxBatch = 64;

/// The batches of posts to one host, one after the other: each is repeated until it is acknowledged.
class BatchPoster {
 public:
  [[nodiscard]] static Result<BatchPoster> create(dds_entity_t participant, dds_entity_t topic,
                                                  const std::string& host);

  [[nodiscard]] dds_entity_t writer() const noexcept { return writer_.get(); }
  /// Whether the host's reader is there.
  [[nodiscard]] bool matched() const noexcept { return has_reader(writer_.get()); }

  /// At most kMaxBatch, whose names fit. The host rejects it if it comes to it after the deadline.
  void post(std::span<const EventId> events, TimePoint now, TimePoint deadline);
  /// The host's clock as it is known now. To be called before post() and whenever it may have changed.
  void use_clock(const HostClock& clock) noexcept;
  void on_ack(const plc_EventAck& ack, TimePoint now);
  /// The last batch that was posted is done.
  [[nodiscard]] bool acknowledged() const noexcept {
    return account_.newest().sequence_number >= last_sequence_;
  }
  /// Repeats what is due to be repeated. Returns when it has to be called again.
  TimePoint repeat(TimePoint now);
  /// Of the last batch.
  [[nodiscard]] PostReport report() const { return account_.report_since(base_); }

 private:
  BatchPoster() = default;
  void write(TimePoint now);
  /// Whether there is a server that was not there at the last call.
  bool has_met_server() noexcept;

  HostClock clock_;
  TimePoint deadline_;
  dds::Entity publisher_;
  dds::Entity writer_;
  plc_EventBatch sample_{};
  std::vector<plc_EventName> names_;
  dds::Guid source_;
  std::uint64_t last_sequence_ = 0;
  TimePoint last_write_;
  NewestEpoch epoch_;
  std::uint32_t readers_met_ = 0;  // at the last has_met_server()
  bool heard_ = false;             // of the server that was met last
  bool has_space_ = true;          // DDS had for the last post
  AckAccount account_;
  AckAccount::Sums base_;
};

}  // namespace plchost
