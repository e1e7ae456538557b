#include "schedulers/tasks/task_kind.hpp"

#include <array>
#include <cstddef>
#include <utility>

namespace plchost {

namespace {

template <std::size_t... kIndex>
std::array<TaskKindEntry, sizeof...(kIndex)> make_entries(std::index_sequence<kIndex...> /*of kTaskKinds*/) {
  return {make_kind_entry<kTaskKinds[kIndex].kind>()...};
}

}  // namespace

const TaskKindEntry* find_task_kind(TaskKind kind) noexcept {
  static const auto kinds = make_entries(std::make_index_sequence<kTaskKinds.size()>());
  for (const TaskKindEntry& entry : kinds) {
    if (entry.kind == kind) return &entry;
  }
  return nullptr;
}

}  // namespace plchost
