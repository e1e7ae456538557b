#include "api/client/log_reader.hpp"

#include <algorithm>
#include <iterator>

#include "api/dds/text.hpp"

namespace plchost {

std::vector<LogText> LogLines::add(const std::vector<dds::Kept<plc_LogRecord>>& records) {
  // Of a manager; a stranger may write a line without an end.
  constexpr std::size_t kLongest = 65'536;
  std::vector<LogText> lines;
  for (const plc_LogRecord& record : records) {
    const std::uint64_t number = record.sequence_number;
    if (number <= last_) continue;
    if (last_ > 0 && number > last_ + 1) {
      missing_ += number - last_ - 1;
      begun_.clear();
    }
    last_ = number;
    begun_ += dds::text_of(record.text);
    if (record.goes_on && begun_.size() < kLongest) continue;
    lines.push_back(
        {.last = record, .missing = std::exchange(missing_, 0), .text = std::exchange(begun_, {})});
  }
  return lines;
}

Async<Result<std::vector<LogText>>> LogReader::read(ClientCore& core, TimePoint deadline,
                                                    std::uint64_t newest) {
  const bool first = place_.stream == 0;
  LogQuery query{.after = place_.after};
  if (first && newest < kLogRecordsKept) query.newest = std::max<std::uint64_t>(newest, 1);
  std::vector<LogText> lines;
  for (bool goes_on = true; goes_on;) {
    PLCHOST_CO_TRY_ASSIGN(const auto page, co_await core.read_log(host_, instance_, query, deadline));
    clock_unix_ns_ = page.clock_unix_ns;
    if (page.stream != place_.stream && place_.stream != 0) {  // another numbering
      place_ = {.stream = page.stream};
      lines_ = LogLines();
      query = {};
      continue;
    }
    auto more = lines_.add(page.records);
    std::ranges::move(more, std::back_inserter(lines));
    goes_on = !page.complete && page.next_after > query.after;
    place_ = {.stream = page.stream, .after = page.next_after};
    query = {.after = page.next_after};
  }
  if (first && lines.size() > newest)
    lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(newest));
  co_return lines;
}

}  // namespace plchost
