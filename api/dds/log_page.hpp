#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <contract_bounds.hpp>
#include <control.h>

#include "api/dds/kept_record.hpp"
#include "api/dds/page_sample.hpp"
#include "shm/base/result.hpp"
#include "shm/pages/log_ring.hpp"

namespace plchost {

/// Which part of the log of an instance is asked for: one of both, or neither (all that is kept).
struct LogQuery {
  std::uint64_t after = 0;   ///< greater numbers only
  std::uint64_t newest = 0;  ///< so many of the newest; 0: not asked
};

/// The query as it travels.
[[nodiscard]] plc_ListPart part_of(const LogQuery& query) noexcept;
/// And back. invalid_argument: both.
[[nodiscard]] Result<LogQuery> log_query_of(const plc_ListPart& part);

/// A part of the log of an instance.
struct LogListing {
  std::uint64_t stream = 0;        ///< when the numbering began; 0: it has said nothing yet
  std::int64_t clock_unix_ns = 0;  ///< of the host
  bool complete = true;
  std::uint64_t next_after = 0;  ///< the next part is what comes after this number
  std::vector<dds::Kept<plc_LogRecord>> records = {};
};

/// The bound of a page.
inline constexpr std::size_t kPageRecords = dds::bounds::LogPage::records;

/// The part of the log that is asked for, at most kPageRecords. An instance without a log has said nothing.
[[nodiscard]] Result<LogListing> look_at_log(std::string_view pool, std::string_view instance,
                                             const LogQuery& query);

/// A listing as it travels.
class LogPageSample : public PageSample<plc_LogPage> {
 public:
  /// At most kPageRecords. The listing outlives it.
  explicit LogPageSample(const LogListing& listing);

 private:
  std::vector<plc_LogRecord> records_;
};

/// A record of the log as it travels.
[[nodiscard]] plc_LogRecord sample_of(const LogRecord& record) noexcept;

[[nodiscard]] LogListing listing_of(const plc_LogPage& page);

}  // namespace plchost
