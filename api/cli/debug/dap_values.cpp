// A DapSession's variables: those of the frames of halted tasks.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/cli/debug/dap_session.hpp"
#include "api/cli/debug/foreign_json.hpp"
#include "api/cli/rows/variable_rows.hpp"
#include "api/dds/text.hpp"
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

Json local_json(const Json& local) {
  const std::string name = local.value("name", "");
  return {{"name", name},
          {"evaluateName", name},
          {"value", local.value("value", "")},
          {"type", local.value("type", "")},
          {"variablesReference", 0}};
}

/// Of an array, in one answer.
constexpr std::uint64_t kMostElements = 1024;
/// Bytes of names in a request to the host.
constexpr std::size_t kMostNames = 4000;

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
  const auto array = ExpandedArray::of(whole, dds::text_of(variable.type));
  if (!array) return told;
  const auto known = std::ranges::find(arrays_, *array);
  told["variablesReference"] = kArrays + (known - arrays_.begin());
  told["indexedVariables"] = array->elements();
  if (known == arrays_.end()) arrays_.push_back(*array);
  return told;
}

const ExpandedArray* DapSession::array_at(std::int64_t reference) const noexcept {
  const std::int64_t place = reference - kArrays;
  if (place < 0 || place >= static_cast<std::int64_t>(arrays_.size())) return nullptr;
  return &arrays_[static_cast<std::size_t>(place)];
}

// A client asks for a part of a long array, or gets the begin of it.
DapSession::Answer DapSession::elements_of(std::int64_t reference, const Json& arguments) {
  const ExpandedArray* const found = array_at(reference);
  if (found == nullptr) return failure(ErrorCode::not_found, "there is no such array");
  const ExpandedArray array = *found;
  const auto start = static_cast<std::uint64_t>(std::max<std::int64_t>(number_in(arguments, "start"), 0));
  const auto wanted = static_cast<std::uint64_t>(std::max<std::int64_t>(number_in(arguments, "count"), 0));
  const std::uint64_t first = std::min(start, array.elements());
  const std::uint64_t most = wanted == 0 ? kMostElements : std::min(wanted, kMostElements);
  const std::uint64_t end = first + std::min(most, array.elements() - first);
  Json made = Json::array();
  VariableQuery query;
  std::size_t bytes = 0;
  const auto take = [&]() -> Result<void> {
    PLCHOST_TRY_ASSIGN(const auto values, link_.listed(std::exchange(query, {})));
    for (const auto& value : values) {
      Json element = variable_json(value, "");
      element["name"] = array.label(dds::text_of(value.name));
      made.push_back(std::move(element));
    }
    bytes = 0;
    return {};
  };
  for (std::uint64_t i = first; i < end; ++i) {
    query.patterns.push_back(array.element(i));
    bytes += query.patterns.back().size() + 1;
    if (bytes > kMostNames || i + 1 == end) {
      PLCHOST_TRY(take());
    }
  }
  return Json{{"variables", std::move(made)}};
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
  const Json frame = frame_at(reference);
  Json made = Json::array();
  if (is_of_globals(reference)) {
    PLCHOST_TRY_ASSIGN(const auto globals, link_.globals());
    for (const auto& variable : globals) made.push_back(variable_json(variable, ""));
    return Json{{"variables", std::move(made)}};
  }
  if (is_of_locals(reference)) {
    PLCHOST_TRY(local_in(frame, ""));
    for (const Json& local : frame.value("locals", Json::array())) made.push_back(local_json(local));
    return Json{{"variables", std::move(made)}};
  }
  const std::string instance = frame.value("instance", "");
  if (!instance.empty()) {
    PLCHOST_TRY_ASSIGN(const auto found, if_found(link_.variables(instance + ".*")));
    if (found) {
      for (const auto& variable : *found) made.push_back(variable_json(variable, instance + "."));
    }
  }
  return Json{{"variables", std::move(made)}};
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
  PLCHOST_TRY_ASSIGN(const auto* const now, local_in(found, name));
  if (now != nullptr) return local_json(*now);
  return failure(ErrorCode::wrong_state, "the task has gone on meanwhile");
}

DapSession::Answer DapSession::written(std::int64_t frame, const std::string& name,
                                       const std::string& value) {
  const Json found = frame_at(frame);
  PLCHOST_TRY_ASSIGN(const auto* const local, local_in(found, name));
  if (local != nullptr) return written_local(frame, name, value);
  return written_variable(found.value("instance", ""), name, value);
}

// The client knows whether it means a local variable.
DapSession::Answer DapSession::set_variable(const Json& arguments) {
  const std::int64_t reference = number_in(arguments, "variablesReference");
  const std::string name = text_in(arguments, "name");
  const std::string value = without_mark(text_in(arguments, "value"));
  if (const ExpandedArray* const array = array_at(reference))
    return written_variable("", array->labelled(name), value);
  if (is_of_globals(reference)) return written_variable("", name, value);
  if (is_of_locals(reference)) return written_local(reference, name, value);
  return written_variable(frame_at(reference).value("instance", ""), name, value);
}

// A name, or in the debug console "NAME := VALUE". For the clipboard: the value alone.
DapSession::Answer DapSession::evaluate(const Json& arguments) {
  const std::string expression = text_in(arguments, "expression");
  const std::int64_t number = number_in(arguments, "frameId");
  const Json frame = frame_at(number);
  const auto trim = [](std::string_view text) { return std::string(trimmed(text)); };
  const std::size_t assign = expression.find(":=");
  Answer made = Json();
  if (assign != std::string::npos && text_in(arguments, "context") == "repl") {
    made = written(number, trim(expression.substr(0, assign)), trim(expression.substr(assign + 2)));
  } else {
    made = evaluated(frame, trim(expression), text_in(arguments, "context"));
  }
  if (!made) return made;
  Json result{{"result", (*made)["value"]},
              {"type", (*made)["type"]},
              {"variablesReference", (*made)["variablesReference"]}};
  if (made->contains("indexedVariables")) result["indexedVariables"] = (*made)["indexedVariables"];
  return result;
}

DapSession::Answer DapSession::evaluated(const Json& frame, const std::string& name,
                                         const std::string& context) {
  PLCHOST_TRY_ASSIGN(const auto* const local, local_in(frame, name));
  if (local != nullptr) return local_json(*local);
  const auto variable = link_.variable(frame.value("instance", ""), name);
  if (!variable) return std::unexpected(error_in_frame(frame, variable.error()));
  Json made = variable_json(*variable, "");
  if (context == "clipboard") made["value"] = dds::text_of(variable->value);
  return made;
}

}  // namespace plchost
