#include "api/cli/verbs/variable_changes.hpp"

#include <utility>

#include <fmt/format.h>

#include "api/dds/text.hpp"

namespace plchost {

VariableChanges::Found VariableChanges::look(const VariableListing& sample) {
  Found found;
  std::map<std::string, std::string, std::less<>> now;
  for (const plc_VariableRecord& variable : sample.variables) {
    std::string name(dds::text_of(variable.name));
    std::string value = fmt::format("{} {}", dds::text_of(variable.value), variable.forced);
    const auto before = last_.find(name);
    if (before == last_.end() || before->second != value) found.changed.push_back(&variable);
    now.emplace(std::move(name), std::move(value));
  }
  for (const auto& [name, value] : last_) {
    if (!now.contains(name)) found.gone.push_back(name);
  }
  last_ = std::move(now);
  found.is_first_torn = !std::exchange(torn_, !sample.consistent) && torn_;
  return found;
}

}  // namespace plchost
