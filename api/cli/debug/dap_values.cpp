// A DapSession's variables: those of the frames of halted tasks.
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

Json variable_json(const plc_VariableRecord& variable, std::string_view prefix) {
  std::string name(dds::text_of(variable.name));
  const std::string whole = name;
  if (name.size() > prefix.size() && name.starts_with(prefix)) name.erase(0, prefix.size());
  return {{"name", name},
          {"evaluateName", whole},
          {"value", marked_value(variable)},
          {"type", dds::text_of(variable.type)},
          {"variablesReference", 0}};
}

Json local_json(const Json& local) {
  const std::string name = local.value("name", "");
  return {{"name", name},
          {"evaluateName", name},
          {"value", local.value("value", "")},
          {"type", local.value("type", "")},
          {"variablesReference", 0}};
}

}  // namespace

Json DapSession::frame_at(std::int64_t number) const {
  const auto thread = static_cast<std::size_t>(number / kFramesOfThread);
  const auto place = static_cast<std::size_t>(number % kFramesOfThread % kLocals);
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
  return Json{{"scopes", std::move(scopes)}};
}

DapSession::Answer DapSession::variables(const Json& arguments) {
  const std::int64_t reference = number_in(arguments, "variablesReference");
  const Json frame = frame_at(reference);
  Json made = Json::array();
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
  PLCHOST_TRY(link_.write_local(tasks_[thread - 1], frame % kFramesOfThread % kLocals, name, value));
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
  return Json{{"result", (*made)["value"]}, {"type", (*made)["type"]}, {"variablesReference", 0}};
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
