#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "shm/base/result.hpp"

namespace plchost {

/// The task of that name in a state of a debugger; null: it has none.
[[nodiscard]] const nlohmann::json* task_in(const nlohmann::json& state, std::string_view name);

/// The local variable, or the element of one, that a name means in a frame: its name, type and value. Null:
/// the frame has none. full: the state was too long to tell it. invalid_argument: it is a structure, or the
/// array has no such element.
[[nodiscard]] Result<nlohmann::json> local_in(const nlohmann::json& frame, std::string_view name);
/// The value of a local variable of a frame, for people; of an array its first elements.
[[nodiscard]] std::string value_of_local(const nlohmann::json& local);

/// The error of a name that means nothing in a frame. It says which local variables a frame does not show.
[[nodiscard]] Error error_in_frame(const nlohmann::json& frame, Error error);

/// Tells a debugger of a task that ignores its breakpoints.
[[nodiscard]] std::string ignoring_text(std::string_view task);

/// News in the states of a debugger, each once: halts, lines of log points, and what another version of the
/// application or another scheduler has changed.
class DebugNews {
 public:
  struct Line {
    std::string text;
    bool is_gap = false;  ///< lines are missing here; the text says how many
  };
  [[nodiscard]] std::vector<Line> lines(const nlohmann::json& state);
  /// The tasks that have halted.
  [[nodiscard]] std::vector<nlohmann::json> halts(const nlohmann::json& state);
  /// This debugger has set a breakpoint, or has deleted one.
  void has_set(std::uint32_t id, std::int64_t line) { lines_[id] = line; }
  void has_deleted(std::uint32_t id) { lines_.erase(id); }
  void has_deleted_all() { lines_.clear(); }
  struct Moved {
    std::uint32_t id = 0;
    std::optional<std::int64_t> line;  ///< nothing: it is gone
  };
  /// Breakpoints of this debugger that are in another line, or gone.
  [[nodiscard]] std::vector<Moved> moved(const nlohmann::json& state);
  /// The tasks that ignore breakpoints, and did not in the first state.
  [[nodiscard]] std::vector<std::string> ignoring(const nlohmann::json& state);
  /// The number of the last halt of each task that was told.
  [[nodiscard]] const std::map<std::string, std::uint64_t>& told() const noexcept { return told_; }

 private:
  std::map<std::string, std::uint64_t> told_;
  std::uint64_t logged_ = 0;
  std::map<std::uint32_t, std::int64_t> lines_;  // of breakpoints
  std::optional<std::set<std::string>> ignoring_;
};

}  // namespace plchost
