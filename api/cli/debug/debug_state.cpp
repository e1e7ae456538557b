#include "api/cli/debug/debug_state.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "shm/variables/variable_symbol.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

// As IEC 61131-3 compares names.
bool same_name(std::string_view left, std::string_view right) {
  const auto folded = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(left, right, {}, folded, folded);
}

}  // namespace

const Json* task_in(const Json& state, std::string_view name) {
  if (!state.contains("tasks")) return nullptr;
  const Json& tasks = state["tasks"];
  const auto found =
      std::ranges::find_if(tasks, [&](const Json& task) { return task.value("task", "") == name; });
  return found == tasks.end() ? nullptr : &*found;
}

Result<const Json*> local_in(const Json& frame, std::string_view name) {
  if (frame.contains("locals_left_out")) {
    return failure(
        ErrorCode::full,
        "the local variables of this call are too long to be told with all others: let other tasks go "
        "on, or delete breakpoints");
  }
  const auto locals = frame.find("locals");
  if (locals == frame.end()) return nullptr;
  const auto found = std::ranges::find_if(
      *locals, [&](const Json& local) { return same_name(local.value("name", ""), name); });
  if (found != locals->end()) return &*found;
  for (const Json& local : *locals) {
    const std::string member = local.value("name", "");
    const bool is_inside = member.size() > name.size() && member[name.size()] == '.';
    if (!name.empty() && is_inside && same_name(std::string_view(member).substr(0, name.size()), name))
      return std::unexpected(has_members(name, member));
  }
  return nullptr;
}

Error error_in_frame(const Json& frame, Error error) {
  if (error.code != ErrorCode::not_found || frame.empty()) return error;
  error.message += "; arrays, references and function blocks among local variables are not shown";
  return error;
}

std::vector<DebugNews::Line> DebugNews::lines(const Json& state) {
  std::vector<Line> fresh;
  const auto miss_until = [&](std::uint64_t number) {
    if (number <= logged_) return;
    fresh.push_back(
        {.text = fmt::format("{} lines of log points came too fast and are missing here", number - logged_),
         .is_gap = true});
    logged_ = number;
  };
  for (const Json& line : state.value("log", Json::array())) {
    const auto number = line.value("number", std::uint64_t{0});
    if (number <= logged_) continue;
    miss_until(number - 1);
    logged_ = number;
    fresh.push_back({.text = line.value("text", "")});
  }
  miss_until(state.value("logged", logged_));
  return fresh;
}

std::vector<Json> DebugNews::halts(const Json& state) {
  std::vector<Json> fresh;
  for (const Json& task : state.value("tasks", Json::array())) {
    if (task.value("state", "") != "halted") continue;
    const auto halt = task.value("halt", std::uint64_t{0});
    if (std::exchange(told_[task.value("task", "")], halt) != halt) fresh.push_back(task);
  }
  return fresh;
}

}  // namespace plchost
