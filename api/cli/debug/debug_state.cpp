#include "api/cli/debug/debug_state.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"
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

std::string ignoring_text(std::string_view task) {
  return fmt::format("task {} ignores breakpoints: its scheduler halts no tasks of external events", task);
}

std::vector<DebugNews::Line> DebugNews::lines(const Json& state) {
  std::vector<Line> fresh;
  const auto miss_until = [&](std::uint64_t number) {
    if (number <= logged_) return;
    fresh.push_back(
        {.text = count_text(number - logged_, "line of a log point is", "lines of log points are") +
                 " missing here: too many came at once",
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

// Of a state that is too long they are left out.
std::vector<DebugNews::Moved> DebugNews::moved(const Json& state) {
  std::vector<Moved> fresh;
  const auto breakpoints = state.find("breakpoints");
  if (breakpoints == state.end()) return fresh;
  for (auto at = lines_.begin(); at != lines_.end();) {
    const auto found = std::ranges::find_if(
        *breakpoints, [&](const Json& one) { return one.value("id", std::uint32_t{0}) == at->first; });
    if (found == breakpoints->end()) {
      fresh.push_back({.id = at->first, .line = std::nullopt});
      at = lines_.erase(at);
      continue;
    }
    const auto line = found->value("line", std::int64_t{0});
    if (std::exchange(at->second, line) != line) fresh.push_back({.id = at->first, .line = line});
    ++at;
  }
  return fresh;
}

// A task that is stopped says nothing.
std::vector<std::string> DebugNews::ignoring(const Json& state) {
  std::vector<std::string> fresh;
  const bool first = !ignoring_;
  if (first) ignoring_.emplace();
  for (const Json& task : state.value("tasks", Json::array())) {
    const std::string name = task.value("task", "");
    const std::string what = task.value("state", "");
    if (what == "ignored") {
      if (ignoring_->insert(name).second && !first) fresh.push_back(name);
    } else if (what != "stopped") {
      ignoring_->erase(name);
    }
  }
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
