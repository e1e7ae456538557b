#pragma once

#include <memory>

#include "schedulers/tasks/task_kind.hpp"

namespace plchost {

/// The class of a kind. Its file says which.
template <TaskKind kKind>
struct KindClass;

template <TaskKind kKind>
TaskKindEntry make_kind_entry() {
  using Kind = typename KindClass<kKind>::Type;
  TaskKindEntry entry = Kind::kEntry;
  entry.kind = kKind;
  entry.check = &Kind::check;
  entry.make = [](const TaskKindContext& context) -> std::unique_ptr<TaskKindState> {
    return std::make_unique<Kind>(context);
  };
  return entry;
}

}  // namespace plchost
