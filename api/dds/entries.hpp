#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <control.h>

#include "api/dds/text.hpp"
#include "shm/base/result.hpp"

namespace plchost::dds {

/// Adds an entry of an `ext`; none for an empty value, which means the same.
inline void add_entry(std::vector<plc_KeyValue>& entries, std::string_view name, std::string_view value) {
  if (value.empty()) return;
  plc_KeyValue& entry = entries.emplace_back();
  copy_text(entry.name, name);
  copy_text(entry.value, value);
}

/// The values of those entries whose names are known, each into its text. invalid_argument: one is there
/// twice.
[[nodiscard]] Result<void> read_entries(std::span<const plc_KeyValue> entries,
                                        std::span<const std::pair<std::string_view, std::string*>> known);

}  // namespace plchost::dds
