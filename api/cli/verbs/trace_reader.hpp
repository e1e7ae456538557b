#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "api/client/client_core.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// A page of a flight recorder, and between which times of this process the host has made it.
struct TracePart {
  TraceListing listing;
  TimePoint asked;
  TimePoint answered;
};

/// The flight recorder of one instance, read on from where it was read to.
class TraceReader {
 public:
  /// An entry may be written so long after its time: so much is read again.
  static constexpr Duration kOverlap = std::chrono::milliseconds(100);

  TraceReader(std::string host, std::string instance)
      : host_(std::move(host)), instance_(std::move(instance)) {}

  /// The first time the numbers of the entries so far, without entries; then those that have come, and some
  /// that had come before. wrong_state: the host's clock begins anew, so it was booted. corrupt: the host's
  /// answers do not go on.
  Async<Result<std::vector<TracePart>>> read(ClientCore& core, TimePoint deadline);
  [[nodiscard]] const std::string& host() const noexcept { return host_; }
  [[nodiscard]] const std::string& instance() const noexcept { return instance_; }

 private:
  std::string host_;
  std::string instance_;
  std::int64_t begin_ns_ = -1;  // by the clock of the host; -1: it was not read yet
  std::int64_t last_ns_ = 0;
};

}  // namespace plchost
