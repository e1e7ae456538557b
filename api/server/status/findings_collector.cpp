#include "api/server/status/findings_collector.hpp"

#include <iterator>

#include <fmt/format.h>

namespace plchost {

Result<std::optional<std::string>> FindingsCollector::add(std::string_view text) {
  PLCHOST_TRY_ASSIGN(auto part, decode_part(text));
  const bool goes_on = !findings_.empty();
  if (goes_on && part.check != check_) {
    findings_.clear();
    if (++restarts_ <= kMaxRestarts) return std::optional(std::string());
    return failure(ErrorCode::busy, "the host is checked for others all the time; try again later");
  }
  if (part.first != findings_.size() || (part.findings.empty() && part.first < part.total)) {
    return failure(ErrorCode::corrupt,
                   fmt::format("findings from {} on where {} was the next", part.first, findings_.size()));
  }
  check_ = part.check;
  findings_.insert(findings_.end(), std::make_move_iterator(part.findings.begin()),
                   std::make_move_iterator(part.findings.end()));
  if (findings_.size() == part.total) return std::optional<std::string>();
  return std::optional(fmt::format("{}", findings_.size()));
}

}  // namespace plchost
