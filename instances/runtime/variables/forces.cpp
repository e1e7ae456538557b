#include "instances/runtime/variables/forces.hpp"

#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "shm/variables/value_message.hpp"

namespace plchost {

static_assert(Forces::kMost == kMaxRequestedValues);

const Forces::Value* Forces::find(VariableElement element) const noexcept {
  const auto found = values_.find({element.symbol, element.element});
  return found == values_.end() ? nullptr : &found->second;
}

Result<void> Forces::set(VariableElement element, Value value) {
  const bool known = find(element) != nullptr;
  const std::size_t bytes =
      std::accumulate(values_.begin(), values_.end(), value.size(),
                      [](std::size_t sum, const auto& entry) { return sum + entry.second.size(); });
  if (!known && (values_.size() == kMost || bytes > kMaxValueBytes)) {
    return failure(ErrorCode::full,
                   fmt::format("{} variables are forced; at most {} with {} bytes can be: end some of them",
                               values_.size(), kMost, kMaxValueBytes));
  }
  values_.insert_or_assign({element.symbol, element.element}, std::move(value));
  return {};
}

bool Forces::erase(VariableElement element) {
  return values_.erase({element.symbol, element.element}) != 0;
}

std::vector<ForceList> Forces::lists(const VariableAccess& access, std::span<const std::string> tasks) const {
  std::vector<ForceList> lists(tasks.size());
  for_each([&](VariableElement element, const Value& value) {
    const std::string& owner = access.symbol(element).task;
    for (std::size_t task = 0; task < tasks.size(); ++task) {
      if (owner.empty() || owner == tasks[task]) lists[task].add(access.bytes(element).data(), value);
    }
  });
  return lists;
}

Forces Forces::carried(const VariableAccess& from, const VariableAccess& to,
                       std::vector<std::string>& ended) const {
  Forces kept;
  for_each([&](VariableElement element, const Value& value) {
    const std::string name = from.name(element);
    const auto place = to.find(name);
    const bool same = place && !to.symbol(*place).read_only &&
                      to.symbol(*place).type == from.symbol(element).type &&
                      to.symbol(*place).bytes == from.symbol(element).bytes;
    if (same) {
      kept.values_.insert_or_assign({place->symbol, place->element}, value);
    } else {
      ended.push_back(name);
    }
  });
  return kept;
}

}  // namespace plchost
