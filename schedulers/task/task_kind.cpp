#include "schedulers/task/task_kind.hpp"

#include <array>

#include "schedulers/task/kinds/cyclic_kind.hpp"
#include "schedulers/task/kinds/event_kind.hpp"
#include "schedulers/task/kinds/external_kind.hpp"
#include "schedulers/task/kinds/freewheeling_kind.hpp"

namespace plchost {

namespace {

template <class Kind>
consteval TaskKindEntry entry_of() {
  TaskKindEntry entry = Kind::kEntry;
  entry.check = &Kind::check;
  entry.make = [](const TaskKindContext& context) -> std::unique_ptr<TaskKindState> {
    return std::make_unique<Kind>(context);
  };
  return entry;
}

constexpr std::array kKinds{
    entry_of<CyclicKind>(),
    entry_of<EventKind>(),
    entry_of<ExternalKind>(),
    entry_of<FreewheelingKind>(),
};

}  // namespace

std::span<const TaskKindEntry> all_task_kinds() noexcept {
  return kKinds;
}

const TaskKindEntry* find_task_kind(TaskKind kind) noexcept {
  for (const TaskKindEntry& entry : kKinds) {
    if (entry.kind == kind) return &entry;
  }
  return nullptr;
}

}  // namespace plchost
