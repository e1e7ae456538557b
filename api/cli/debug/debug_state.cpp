#include "api/cli/debug/debug_state.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/cli/debug/expanded_array.hpp"
#include "shm/base/names.hpp"
#include "shm/variables/indexed_name.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

// Of an array in one line.
constexpr std::size_t kShownElements = 64;

}  // namespace

const Json* task_in(const Json& state, std::string_view name) {
  if (!state.contains("tasks")) return nullptr;
  const Json& tasks = state["tasks"];
  const auto found =
      std::ranges::find_if(tasks, [&](const Json& task) { return task.value("task", "") == name; });
  return found == tasks.end() ? nullptr : &*found;
}

std::string value_of_local(const Json& local) {
  const auto elements = local.find("elements");
  if (elements == local.end()) return local.value("value", "");
  const auto array = ExpandedArray::of(local.value("name", ""), local.value("type", ""));
  std::string text = "[";
  std::size_t told = 0;
  for (const Json& element : *elements) {
    if (told == kShownElements) break;
    text += fmt::format("{}{}", told++ == 0 ? "" : ", ", element.get<std::string>());
  }
  if (!array || array->elements() <= told) return text + "]";
  return text + (told == 0 ? "...]" : ", ...]");
}

namespace {

Result<Json> element_of(const Json& local, const IndexedName& indexed) {
  const std::string name = local.value("name", "");
  const auto array = ExpandedArray::of(name, local.value("type", ""));
  const Json elements = local.value("elements", Json::array());
  const bool is_whole =
      std::ranges::none_of(indexed.indexes, [](const auto& index) { return index.has_value(); });
  if (is_whole) {
    Json whole = local;
    whole["value"] = value_of_local(local);
    return whole;
  }
  if (!array) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{} is no array: it is {}", shown(name), local.value("type", "")));
  }
  PLCHOST_TRY_ASSIGN(const auto number, array->number(indexed));
  std::string value = "(no element is told)";
  if (number < elements.size()) {
    value = elements[number].get<std::string>();
  } else if (!elements.empty()) {
    value = fmt::format("(only the first {} elements are told)", elements.size());
  }
  return Json{{"name", array->element(number)}, {"type", array->element_type()}, {"value", std::move(value)}};
}

}  // namespace

Result<Json> local_in(const Json& frame, std::string_view name) {
  if (frame.contains("locals_left_out")) {
    return failure(
        ErrorCode::full,
        "the local variables of this call are too long to be told with all others: let other tasks go "
        "on, or delete breakpoints");
  }
  const auto locals = frame.find("locals");
  if (locals == frame.end()) return Json();
  const auto indexed = IndexedName::parse(name);
  const std::string_view canonical = indexed ? std::string_view(indexed->canonical) : name;
  const auto found = std::ranges::find_if(
      *locals, [&](const Json& local) { return same_without_brackets(local.value("name", ""), canonical); });
  if (found != locals->end())
    return indexed ? element_of(*found, *indexed) : std::unexpected(indexed.error());
  for (const Json& local : *locals) {
    const std::string member = local.value("name", "");
    const bool is_inside = member.size() > canonical.size() &&
                           (member[canonical.size()] == '.' || member[canonical.size()] == '[');
    if (!name.empty() && is_inside &&
        same_variable_name(std::string_view(member).substr(0, canonical.size()), canonical))
      return std::unexpected(has_members(name, member));
  }
  return Json();
}

Error error_in_frame(const Json& frame, Error error) {
  if (error.code != ErrorCode::not_found || frame.empty()) return error;
  error.message += "; references and function blocks among local variables are not shown";
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
