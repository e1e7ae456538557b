#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "shm/base/result.hpp"

namespace plchost {

/// The task of that name in a state of a debugger; null: it has none.
[[nodiscard]] const nlohmann::json* task_in(const nlohmann::json& state, std::string_view name);

/// The local variable that a name means in a frame: its name, type and value. Null: the frame has none. full:
/// the state was too long to tell them. invalid_argument: it is a structure.
[[nodiscard]] Result<const nlohmann::json*> local_in(const nlohmann::json& frame, std::string_view name);

/// The error of a name that means nothing in a frame. It says which local variables a frame does not show.
[[nodiscard]] Error error_in_frame(const nlohmann::json& frame, Error error);

/// News in the states of a debugger: each halt and each line of a log point, once.
class DebugNews {
 public:
  struct Line {
    std::string text;
    bool is_gap = false;  ///< lines are missing here; the text says how many
  };
  [[nodiscard]] std::vector<Line> lines(const nlohmann::json& state);
  /// The tasks that have halted.
  [[nodiscard]] std::vector<nlohmann::json> halts(const nlohmann::json& state);
  /// The number of the last halt of each task that was told.
  [[nodiscard]] const std::map<std::string, std::uint64_t>& told() const noexcept { return told_; }

 private:
  std::map<std::string, std::uint64_t> told_;
  std::uint64_t logged_ = 0;
};

}  // namespace plchost
