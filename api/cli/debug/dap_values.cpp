// A DapSession's variables: those of the frames of halted tasks.
#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "api/cli/debug/dap_session.hpp"
#include "api/cli/debug/foreign_json.hpp"
#include "api/cli/rows/variable_rows.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

// In the value's text, as that is all that every editor shows.
std::string marked_value(const plc_VariableRecord& variable) {
  const std::string_view forced = forced_text(variable);
  const std::string_view value = dds::text_of(variable.value);
  return forced.empty() ? std::string(value) : fmt::format("{} ({})", value, forced);
}

// An editor offers the text that it shows as the new value. A string that ends so is written in quotes.
std::string without_mark(std::string value) {
  constexpr std::string_view kMark = " (forced)";
  if (value.ends_with(kMark)) value.erase(value.size() - kMark.size());
  return value;
}

/// Of an array, for a client that knows of no parts.
constexpr std::uint64_t kMostElements = 1024;
/// The client of an array waits for no more than what could be read until then.
constexpr auto kArrayPatience = std::chrono::seconds(5);
/// Bytes of names in a request to the host.
constexpr std::size_t kMostNames = 8000;

/// The children that a client asks for: "start" and "count" of those that "filter" means. 0 and none mean
/// all.
struct Part {
  std::uint64_t first = 0;
  std::uint64_t end = 0;
  bool all = false;  ///< the client knows of no parts

  Part(const Json& arguments, std::uint64_t size, std::string_view kind) {
    const std::string filter = text_in(arguments, "filter");
    if (!filter.empty() && filter != kind) return;
    const auto at_least_0 = [&](const char* key) {
      return static_cast<std::uint64_t>(std::max<std::int64_t>(number_in(arguments, key), 0));
    };
    const std::uint64_t count = at_least_0("count");
    first = std::min(at_least_0("start"), size);
    end = first + std::min(count == 0 ? size : count, size - first);
    all = count == 0;
  }
};
constexpr std::string_view kIndexed = "indexed";
constexpr std::string_view kNamed = "named";

Json asked_children(Json children, const Json& arguments) {
  const Part part(arguments, children.size(), kNamed);
  children.erase(children.begin() + static_cast<std::ptrdiff_t>(part.end), children.end());
  children.erase(children.begin(), children.begin() + static_cast<std::ptrdiff_t>(part.first));
  return Json{{"variables", std::move(children)}};
}

Json element_json(const ExpandedArray& array, std::uint64_t number, const std::string& value) {
  const std::string whole = array.element(number);
  return {{"name", array.label(whole)},
          {"evaluateName", whole},
          {"value", value},
          {"type", array.element_type()},
          {"variablesReference", 0}};
}

}  // namespace

Json DapSession::variable_json(const plc_VariableRecord& variable, std::string_view prefix) {
  std::string name(dds::text_of(variable.name));
  const std::string whole = name;
  if (name.size() > prefix.size() && name.starts_with(prefix)) name.erase(0, prefix.size());
  Json told{{"name", name},
            {"evaluateName", whole},
            {"value", marked_value(variable)},
            {"type", dds::text_of(variable.type)},
            {"variablesReference", 0}};
  make_expandable(told, dds::text_of(variable.type), 0);
  return told;
}

Json DapSession::local_json(const Json& local, std::int64_t locals) {
  const std::string name = local.value("name", "");
  Json told{{"name", name},
            {"evaluateName", name},
            {"value", value_of_local(local)},
            {"type", local.value("type", "")},
            {"variablesReference", 0}};
  make_expandable(told, local.value("type", ""), locals);
  return told;
}

void DapSession::make_expandable(Json& told, std::string_view type, std::int64_t locals) {
  const std::string name = told.value("evaluateName", "");
  auto array = ExpandedArray::of(name, type);
  if (!array) return;
  told["indexedVariables"] = array->elements();
  told["namedVariables"] = 0;
  const auto [known, is_new] =
      array_numbers_.try_emplace(fmt::format("{} {} {}", locals, name, type), arrays_.size());
  told["variablesReference"] = kArrays + static_cast<std::int64_t>(known->second);
  if (is_new) arrays_.push_back({.array = *std::move(array), .locals = locals});
}

const DapSession::ShownArray* DapSession::array_at(std::int64_t reference) const noexcept {
  const std::int64_t place = reference - kArrays;
  if (place < 0 || place >= static_cast<std::int64_t>(arrays_.size())) return nullptr;
  return &arrays_[static_cast<std::size_t>(place)];
}

DapSession::Answer DapSession::elements_of(std::int64_t reference, const Json& arguments) {
  const ShownArray* const found = array_at(reference);
  if (found == nullptr) return failure(ErrorCode::not_found, "there is no such array");
  const ShownArray shown = *found;
  const Part part(arguments, shown.array.elements(), kIndexed);
  const std::uint64_t end = part.all ? std::min(part.end, part.first + kMostElements) : part.end;
  PLCHOST_TRY_ASSIGN(auto made, shown.locals == 0 ? declared_elements(shown.array, part.first, end)
                                                  : local_elements(shown, part.first, end));
  if (const std::uint64_t wanted = part.end - part.first; made.size() < wanted) {
    made.push_back({{"name", "..."},
                    {"value", fmt::format("{} not told", count_text(wanted - made.size(), "element"))},
                    {"variablesReference", 0}});
  }
  return Json{{"variables", std::move(made)}};
}

DapSession::Answer DapSession::declared_elements(const ExpandedArray& array, std::uint64_t first,
                                                 std::uint64_t end) {
  Json made = Json::array();
  VariableQuery query;
  std::size_t bytes = 0;
  const TimePoint latest = link_.now() + kArrayPatience;
  for (std::uint64_t i = first; i < end && link_.now() < latest; ++i) {
    query.patterns.push_back(array.element(i));
    bytes += query.patterns.back().size() + 1;
    if (bytes + kMaxVariableName <= kMostNames && i + 1 != end) continue;
    PLCHOST_TRY_ASSIGN(const auto values, link_.listed(std::exchange(query, {})));
    for (const auto& value : values) {
      Json element = variable_json(value, "");
      element["name"] = array.label(dds::text_of(value.name));
      made.push_back(std::move(element));
    }
    bytes = 0;
  }
  return made;
}

// Those that the state tells.
DapSession::Answer DapSession::local_elements(const ShownArray& shown, std::uint64_t first,
                                              std::uint64_t end) const {
  const Json locals = frame_at(shown.locals).value("locals", Json::array());
  const auto found = std::ranges::find_if(
      locals, [&](const Json& local) { return local.value("name", "") == shown.array.name(); });
  if (found == locals.end()) return failure(ErrorCode::wrong_state, "there is no such array any more");
  const Json elements = found->value("elements", Json::array());
  Json made = Json::array();
  for (std::uint64_t i = first; i < std::min<std::uint64_t>(end, elements.size()); ++i)
    made.push_back(element_json(shown.array, i, elements[i].get<std::string>()));
  return made;
}

Json DapSession::frame_at(std::int64_t number) const {
  const auto thread = static_cast<std::size_t>(number / kFramesOfThread);
  const auto place = static_cast<std::size_t>(number % kFramesOfThread % kFrames);
  if (number <= 0 || thread < 1 || thread > tasks_.size()) return Json::object();
  const Json* const task = task_in(state_, tasks_[thread - 1]);
  const Json stack = task == nullptr ? Json::array() : task->value("stack", Json::array());
  return place < stack.size() ? stack[place] : Json::object();
}

DapSession::Answer DapSession::scopes(const Json& arguments) {
  const std::int64_t number = number_in(arguments, "frameId");
  const Json frame = frame_at(number);
  const std::string instance = frame.value("instance", "");
  Json scopes = Json::array();
  if (frame.contains("locals") || frame.contains("locals_left_out")) {
    scopes.push_back({{"name", "Locals"},
                      {"variablesReference", number + kLocals},
                      {"namedVariables", frame.value("locals", Json::array()).size()},
                      {"indexedVariables", 0},
                      {"expensive", false},
                      {"presentationHint", "locals"}});
  }
  if (!instance.empty()) {
    scopes.push_back({{"name", instance},
                      {"variablesReference", number},
                      {"expensive", false},
                      {"presentationHint", "locals"}});
  }
  // Expensive: they are read when the client opens them.
  if (!frame.empty())
    scopes.push_back({{"name", "Globals"}, {"variablesReference", number + kGlobals}, {"expensive", true}});
  return Json{{"scopes", std::move(scopes)}};
}

DapSession::Answer DapSession::variables(const Json& arguments) {
  const std::int64_t reference = number_in(arguments, "variablesReference");
  if (reference >= kArrays) return elements_of(reference, arguments);
  if (text_in(arguments, "filter") == kIndexed) return Json{{"variables", Json::array()}};
  const Json frame = frame_at(reference);
  Json made = Json::array();
  if (is_of_globals(reference)) {
    PLCHOST_TRY_ASSIGN(const auto globals, link_.globals());
    for (const auto& variable : globals) made.push_back(variable_json(variable, ""));
    return asked_children(std::move(made), arguments);
  }
  if (is_of_locals(reference)) {
    PLCHOST_TRY(local_in(frame, ""));
    for (const Json& local : frame.value("locals", Json::array()))
      made.push_back(local_json(local, reference));
    return asked_children(std::move(made), arguments);
  }
  const std::string instance = frame.value("instance", "");
  if (!instance.empty()) {
    PLCHOST_TRY_ASSIGN(const auto found, if_found(link_.variables(instance + ".*")));
    if (found) {
      for (const auto& variable : *found) made.push_back(variable_json(variable, instance + "."));
    }
  }
  return asked_children(std::move(made), arguments);
}

DapSession::Answer DapSession::written_variable(const std::string& instance, const std::string& name,
                                                const std::string& value) {
  PLCHOST_TRY_ASSIGN(const auto whole, link_.write(instance, name, value));
  PLCHOST_TRY_ASSIGN(const auto now, link_.variable("", whole));
  return variable_json(now, "");
}

DapSession::Answer DapSession::written_local(std::int64_t frame, const std::string& name,
                                             const std::string& value) {
  if (frame_at(frame).empty()) return failure(ErrorCode::wrong_state, "there is no such frame any more");
  const auto thread = static_cast<std::size_t>(frame / kFramesOfThread);
  PLCHOST_TRY(link_.write_local(tasks_[thread - 1], frame % kFramesOfThread % kFrames, name, value));
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  const Json found = frame_at(frame);
  PLCHOST_TRY_ASSIGN(const auto now, local_in(found, name));
  if (!now.is_null()) return local_json(now, locals_of(frame));
  return failure(ErrorCode::wrong_state, "the task has gone on meanwhile");
}

DapSession::Answer DapSession::written(std::int64_t frame, const std::string& name,
                                       const std::string& value) {
  const Json found = frame_at(frame);
  PLCHOST_TRY_ASSIGN(const auto local, local_in(found, name));
  if (!local.is_null()) return written_local(frame, name, value);
  return written_variable(found.value("instance", ""), name, value);
}

// The client knows whether it means a local variable.
DapSession::Answer DapSession::set_variable(const Json& arguments) {
  const std::int64_t reference = number_in(arguments, "variablesReference");
  const std::string name = text_in(arguments, "name");
  const std::string value = without_mark(text_in(arguments, "value"));
  if (const ShownArray* const shown = array_at(reference)) {
    const std::string whole = shown->array.labelled(name);
    return shown->locals == 0 ? written_variable("", whole, value)
                              : written_local(shown->locals, whole, value);
  }
  if (is_of_globals(reference)) return written_variable("", name, value);
  if (is_of_locals(reference)) return written_local(reference, name, value);
  return written_variable(frame_at(reference).value("instance", ""), name, value);
}

// A name, or in the debug console "NAME := VALUE". For the clipboard: the value alone.
DapSession::Answer DapSession::evaluate(const Json& arguments) {
  const std::string expression = text_in(arguments, "expression");
  const std::int64_t number = number_in(arguments, "frameId");
  const auto trim = [](std::string_view text) { return std::string(trimmed(text)); };
  const std::size_t assign = expression.find(":=");
  Answer made = Json();
  if (assign != std::string::npos && text_in(arguments, "context") == "repl") {
    made = written(number, trim(expression.substr(0, assign)), trim(expression.substr(assign + 2)));
  } else {
    made = evaluated(number, trim(expression), text_in(arguments, "context"));
  }
  if (!made) return made;
  Json result{{"result", (*made)["value"]},
              {"type", (*made)["type"]},
              {"variablesReference", (*made)["variablesReference"]}};
  for (const char* const key : {"indexedVariables", "namedVariables"}) {
    if (made->contains(key)) result[key] = (*made)[key];
  }
  return result;
}

DapSession::Answer DapSession::evaluated(std::int64_t number, const std::string& name,
                                         const std::string& context) {
  const Json frame = frame_at(number);
  PLCHOST_TRY_ASSIGN(const auto local, local_in(frame, name));
  if (!local.is_null()) return local_json(local, locals_of(number));
  const auto variable = link_.variable(frame.value("instance", ""), name);
  if (!variable) return std::unexpected(error_in_frame(frame, variable.error()));
  Json made = variable_json(*variable, "");
  if (context == "clipboard") made["value"] = dds::text_of(variable->value);
  return made;
}

}  // namespace plchost
