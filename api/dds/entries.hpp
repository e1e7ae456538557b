#pragma once

#include <string_view>
#include <vector>

#include <control.h>

#include "api/dds/text.hpp"

namespace plchost::dds {

/// Adds an entry of an `ext`; none for an empty value, which means the same.
inline void add_entry(std::vector<plc_KeyValue>& entries, std::string_view name, std::string_view value) {
  if (value.empty()) return;
  plc_KeyValue& entry = entries.emplace_back();
  copy_text(entry.name, name);
  copy_text(entry.value, value);
}

}  // namespace plchost::dds
