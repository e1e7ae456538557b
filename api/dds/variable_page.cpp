#include "api/dds/variable_page.hpp"

#include <string_view>

#include <fmt/format.h>

#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::size_t kMostText = sizeof(plc_ListPart::patterns) - 1;

}  // namespace

Result<plc_ListPart> part_of(const VariableQuery& query) {
  plc_ListPart part{};
  part.after = query.after;
  part.forced = query.forced;
  std::string lines;
  for (const std::string& pattern : query.patterns) {
    if (pattern.empty() || pattern.find_first_of(std::string_view("\n\0", 2)) != std::string::npos) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("'{}' is no name of a variable and no pattern", shown(pattern)));
    }
    lines += lines.empty() ? pattern : "\n" + pattern;
  }
  if (lines.size() > kMostText) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("the names of {} variables have {} bytes; a request has room for {}: ask for "
                               "fewer, or by patterns",
                               query.patterns.size(), lines.size(), kMostText));
  }
  dds::copy_text(part.patterns, lines);
  return part;
}

VariableQuery variable_query_of(const plc_ListPart& part) {
  VariableQuery query{.patterns = {}, .forced = part.forced, .after = part.after};
  std::string_view rest = dds::text_of(part.patterns);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    if (end > 0) query.patterns.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return query;
}

Result<void> is_whole(const VariableListing& page) {
  if (page.complete) return {};
  return failure(
      ErrorCode::full,
      fmt::format(
          "these are more variables than one sample holds ({}, and 96 KiB of their values): name fewer",
          kPageVariables));
}

VariablePageSample::VariablePageSample(VariableAnswer& answer) {
  answer.variables.resize(std::min(answer.variables.size(), kPageVariables));
  page_.stream = answer.stream;
  page_.time_unix_ns = answer.time_unix_ns;
  page_.time_monotonic_ns = answer.time_monotonic_ns;
  page_.consistent = answer.consistent;
  page_.complete = answer.complete;
  page_.next_after = answer.next_after;
  dds::lend(page_.variables, answer.variables);
}

VariableListing listing_of(const plc_VariablePage& page) {
  VariableListing listing{.stream = page.stream,
                          .time_unix_ns = page.time_unix_ns,
                          .time_monotonic_ns = page.time_monotonic_ns,
                          .consistent = page.consistent,
                          .complete = page.complete,
                          .next_after = page.next_after,
                          .variables = {}};
  const auto variables = dds::parts_of(page.variables);
  listing.variables.assign(variables.begin(), variables.end());
  return listing;
}

}  // namespace plchost
