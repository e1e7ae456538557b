#include "api/server/instance_extension.hpp"

#include <string_view>

#include "api/dds/text.hpp"

namespace plchost {

std::vector<plc_KeyValue> extension_of(const InstanceRuntime& runtime) {
  std::vector<plc_KeyValue> entries;
  const auto add = [&](std::string_view name, std::string_view value) {
    if (value.empty()) return;
    plc_KeyValue& entry = entries.emplace_back();
    dds::copy_text(entry.name, name);
    dds::copy_text(entry.value, value);
  };
  add("tick_source", runtime.tick_source.view());
  add("tick_fallback", runtime.tick_fallback.view());
  add("idle_states", runtime.idle_states.view());
  return entries;
}

}  // namespace plchost
