#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "api/client/client_core.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/log_ring.hpp"

namespace plchost {

/// A line of the log of an instance, put together from its records.
struct LogText {
  dds::Kept<plc_LogRecord> last{};  ///< of its records; `text` has all of them
  std::uint64_t missing = 0;        ///< records that are missing before it
  std::string text;
};

/// Makes lines of records that come in pieces.
class LogLines {
 public:
  LogLines() = default;
  /// All up to that number was seen.
  explicit LogLines(std::uint64_t last) noexcept : last_(last) {}
  /// The lines that are whole by now, in their order.
  [[nodiscard]] std::vector<LogText> add(const std::vector<dds::Kept<plc_LogRecord>>& records);

 private:
  std::uint64_t last_ = 0;  // 0: none was seen
  std::uint64_t missing_ = 0;
  std::string begun_;
};

/// Where a reader of a log is.
struct LogPlace {
  std::uint64_t stream = 0;  ///< when the numbering began; 0: nothing was read
  std::uint64_t after = 0;   ///< the number of the last record that was read
};

/// The log of one instance, read on from where it was read to.
class LogReader {
 public:
  LogReader(std::string host, std::string instance, LogPlace place = {})
      : host_(std::move(host)), instance_(std::move(instance)), place_(place), lines_(place.after) {}

  /// The lines that are new. From the beginning: those that are kept, of them the `newest`. If the log has
  /// begun anew, all of it. The code of the failure is the host's own: not_found: it has no such instance.
  Async<Result<std::vector<LogText>>> read(ClientCore& core, TimePoint deadline,
                                           std::uint64_t newest = kLogRecordsKept);
  [[nodiscard]] const std::string& host() const noexcept { return host_; }
  [[nodiscard]] const LogPlace& place() const noexcept { return place_; }
  /// The host's clock at the last read.
  [[nodiscard]] std::int64_t clock_unix_ns() const noexcept { return clock_unix_ns_; }

 private:
  std::string host_;
  std::string instance_;
  LogPlace place_;
  LogLines lines_;
  std::int64_t clock_unix_ns_ = 0;
};

}  // namespace plchost
