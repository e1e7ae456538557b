#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <control.h>

#include "api/client/newest_epoch.hpp"
#include "api/dds/guid.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Sends the pieces of one download to one host, at most a window of them at a time. When nothing moves, or
/// when a new plchost-dds begins anew, it sends again from where the host is.
class FileSender {
 public:
  static constexpr Duration kRepeat = std::chrono::milliseconds(200);
  /// A host is looked for so often while it does not read.
  static constexpr Duration kLook = std::chrono::milliseconds(50);

  /// `contents` outlives it. `topic` is that of pieces.
  [[nodiscard]] static Result<FileSender> create(dds_entity_t participant, dds_entity_t topic,
                                                 const std::string& host,
                                                 std::span<const std::byte> contents);

  /// `download`: the identity of the request that began it.
  void on_ack(const plc_DownloadAck& ack, const plc_SampleIdentity& download, TimePoint now);
  /// Writes what may be written; returns when there is more to do. `limit`: later the host takes none of it.
  TimePoint send(const plc_SampleIdentity& download, const plc_TimeLimit& limit, TimePoint now);

  /// So many bytes are at the host.
  [[nodiscard]] std::uint64_t received() const noexcept { return received_; }
  [[nodiscard]] bool complete() const noexcept { return received_ == contents_.size(); }
  /// When the host last told something new.
  [[nodiscard]] TimePoint last_news() const noexcept { return last_news_; }

 private:
  FileSender() = default;

  dds::PartitionWriter way_;  // to the host
  std::string host_;
  std::span<const std::byte> contents_;
  NewestEpoch epoch_;           // of the host's acknowledgements
  std::uint64_t received_ = 0;  // acknowledged
  std::uint64_t next_ = 0;      // to be written
  std::uint64_t window_ = 0;
  TimePoint last_news_;
  TimePoint last_try_;
};

}  // namespace plchost
