#include "api/dds/log_page.hpp"

#include <algorithm>
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

plc_LogRecord sample_of(const LogRecord& record) noexcept {
  plc_LogRecord sample{.sequence_number = record.sequence,
                       .time_unix_ns = record.time_unix_ns,
                       .pid = record.pid,
                       .level = std::to_underlying(record.level),
                       .source = std::to_underlying(record.source),
                       .goes_on = record.goes_on != 0,
                       .text = {}};
  dds::copy_text(sample.text, record.text.view());
  return sample;
}

// Codes that are not known here are those of a newer host.
LogRecord record_of(const plc_LogRecord& sample) {
  return {.sequence = sample.sequence_number,
          .time_unix_ns = sample.time_unix_ns,
          .pid = sample.pid,
          .level = static_cast<LogLevel>(sample.level),
          .source = static_cast<LogSource>(sample.source),
          .goes_on = sample.goes_on ? 1U : 0U,
          .text = FixedText<kMaxLogText>(dds::text_of(sample.text))};
}

}  // namespace

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
  const auto reader = LogRingReader::open(pool, instance);
  if (!reader && reader.error().code == ErrorCode::not_found) return listing;
  PLCHOST_TRY(reader);
  LogSlice slice =
      query.newest > 0 ? reader->newest(query.newest, kPageRecords) : reader->read(query.after, kPageRecords);
  listing.stream = static_cast<std::uint64_t>(slice.stream_unix_ns);
  listing.records = std::move(slice.records);
  listing.complete = listing.records.size() < kPageRecords || listing.records.back().sequence >= slice.last;
  if (listing.complete) {
    listing.next_after = slice.last;
  } else {
    listing.next_after = listing.records.back().sequence;
  }
  return listing;
}

LogPageSample::LogPageSample(const LogListing& listing) {
  const std::size_t count = std::min(listing.records.size(), kPageRecords);
  for (std::size_t i = 0; i < count; ++i) records_.push_back(sample_of(listing.records[i]));
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
  for (const plc_LogRecord& record : dds::parts_of(page.records)) {
    listing.records.push_back(record_of(record));
  }
  return listing;
}

}  // namespace plchost
