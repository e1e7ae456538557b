#include "api/dds/log_page.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"
#include "shm/base/time.hpp"

namespace plchost {

namespace {

static_assert(sizeof(plc_LogRecord::text) == kMaxLogText + 1);

}  // namespace

plc_LogRecord sample_of(const LogRecord& record) noexcept {
  plc_LogRecord sample{.sequence_number = record.sequence,
                       .time_unix_ns = record.time_unix_ns,
                       .pid = record.pid,
                       .level = std::to_underlying(record.level),
                       .source = std::to_underlying(record.source),
                       .goes_on = record.goes_on != 0,
                       .text = {},
                       .ext = {}};
  dds::copy_text(sample.text, record.text.view());
  return sample;
}

plc_ListPart part_of(const LogQuery& query) noexcept {
  plc_ListPart part{};
  part.after = query.after;
  part.newest = query.newest;
  return part;
}

Result<LogQuery> log_query_of(const plc_ListPart& part) {
  if (part.after != 0 && part.newest != 0) {
    return failure(ErrorCode::invalid_argument, "'after' and 'newest' exclude each other");
  }
  return LogQuery{.after = part.after, .newest = part.newest};
}

Result<LogListing> look_at_log(std::string_view pool, std::string_view instance, const LogQuery& query) {
  LogListing listing{.clock_unix_ns = unix_time_ns(), .next_after = query.after};
  PLCHOST_TRY_ASSIGN(const auto reader, if_found(LogRingReader::open(pool, instance)));
  if (!reader) return listing;
  const LogSlice slice =
      query.newest > 0 ? reader->newest(query.newest, kPageRecords) : reader->read(query.after, kPageRecords);
  listing.stream = static_cast<std::uint64_t>(slice.stream_unix_ns);
  std::ranges::transform(slice.records, std::back_inserter(listing.records),
                         [](const LogRecord& record) { return sample_of(record); });
  const bool whole = listing.records.size() < kPageRecords;
  listing.complete = whole || listing.records.back().sequence_number >= slice.last;
  listing.next_after = listing.complete ? slice.last : listing.records.back().sequence_number;
  return listing;
}

LogPageSample::LogPageSample(const LogListing& listing) {
  const auto count = static_cast<std::ptrdiff_t>(std::min(listing.records.size(), kPageRecords));
  records_.assign(listing.records.begin(), listing.records.begin() + count);
  page_.stream = listing.stream;
  page_.clock_unix_ns = listing.clock_unix_ns;
  page_.complete = listing.complete;
  page_.next_after = listing.next_after;
  dds::lend(page_.records, records_);
}

LogListing listing_of(const plc_LogPage& page) {
  LogListing listing{.stream = page.stream,
                     .clock_unix_ns = page.clock_unix_ns,
                     .complete = page.complete,
                     .next_after = page.next_after,
                     .records = {}};
  const auto records = dds::parts_of(page.records);
  listing.records.assign(records.begin(), records.end());
  return listing;
}

}  // namespace plchost
