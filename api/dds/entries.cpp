#include "api/dds/entries.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace plchost::dds {

Result<void> read_entries(std::span<const plc_KeyValue> entries,
                          std::span<const std::pair<std::string_view, std::string*>> known) {
  for (const plc_KeyValue& entry : entries) {
    const auto found =
        std::ranges::find(known, text_of(entry.name), &std::pair<std::string_view, std::string*>::first);
    if (found == known.end()) continue;
    if (!found->second->empty()) {
      return failure(ErrorCode::invalid_argument, fmt::format("'{}' is there twice", found->first));
    }
    *found->second = text_of(entry.value);
  }
  return {};
}

}  // namespace plchost::dds
