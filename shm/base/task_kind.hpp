#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

namespace plchost {

/// The kinds of tasks. The numbers are those of Task_Info::KindOfTask and of TaskStatus.kind.
enum class TaskKind : std::uint32_t { cyclic = 0, event = 1, external = 2, freewheeling = 3 };

/// How the application describes a task of one kind.
struct TaskKindTraits {
  TaskKind kind;
  std::string_view name;        ///< in status and messages: control.idl has the same word
  bool has_interval = false;    ///< dwInterval is used
  bool reads_variable = false;  ///< dwEventFunctionPointer is used
  bool names_event = false;     ///< stExternalEvent is used; it runs for the posts of that event
};

inline constexpr std::array kTaskKinds{
    TaskKindTraits{.kind = TaskKind::cyclic, .name = "cyclic", .has_interval = true},
    TaskKindTraits{.kind = TaskKind::event, .name = "event", .reads_variable = true},
    TaskKindTraits{.kind = TaskKind::external, .name = "external", .names_event = true},
    TaskKindTraits{.kind = TaskKind::freewheeling, .name = "freewheeling"},
};

/// Null: there is no such kind. Any context.
[[nodiscard]] constexpr const TaskKindTraits* find_traits(TaskKind kind) noexcept {
  const auto found = std::ranges::find(kTaskKinds, kind, &TaskKindTraits::kind);
  return found == kTaskKinds.end() ? nullptr : &*found;
}
/// `kind` is one of kTaskKinds. Any context.
[[nodiscard]] constexpr const TaskKindTraits& traits_of(TaskKind kind) noexcept {
  return *find_traits(kind);
}

}  // namespace plchost
