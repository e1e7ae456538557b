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

}  // namespace

std::string DapSession::instance_of(std::int64_t frame) const {
  const auto thread = static_cast<std::size_t>(frame / kFramesOfThread);
  const auto place = static_cast<std::size_t>(frame % kFramesOfThread);
  if (frame <= 0 || thread < 1 || thread > tasks_.size()) return {};
  const Json* const task = task_in(state_, tasks_[thread - 1]);
  const Json stack = task == nullptr ? Json::array() : task->value("stack", Json::array());
  return place < stack.size() ? stack[place].value("instance", "") : std::string();
}

// The variables of a frame have its number.
DapSession::Answer DapSession::scopes(const Json& arguments) {
  const std::int64_t frame = number_in(arguments, "frameId");
  const std::string instance = instance_of(frame);
  Json scopes = Json::array();
  if (!instance.empty()) {
    scopes.push_back({{"name", instance},
                      {"variablesReference", frame},
                      {"expensive", false},
                      {"presentationHint", "locals"}});
  }
  return Json{{"scopes", std::move(scopes)}};
}

DapSession::Answer DapSession::variables(const Json& arguments) {
  const std::string instance = instance_of(number_in(arguments, "variablesReference"));
  Json made = Json::array();
  if (!instance.empty()) {
    auto found = link_.variables(instance + ".*");
    if (!found && found.error().code != ErrorCode::not_found) return std::unexpected(found.error());
    if (found) {
      for (const auto& variable : *found) made.push_back(variable_json(variable, instance + "."));
    }
  }
  return Json{{"variables", std::move(made)}};
}

DapSession::Answer DapSession::written(const std::string& instance, const std::string& name,
                                       const std::string& value) {
  PLCHOST_TRY_ASSIGN(const auto whole, link_.write(instance, name, value));
  PLCHOST_TRY_ASSIGN(const auto now, link_.variable("", whole));
  return variable_json(now, "");
}

DapSession::Answer DapSession::set_variable(const Json& arguments) {
  return written(instance_of(number_in(arguments, "variablesReference")), text_in(arguments, "name"),
                 without_mark(text_in(arguments, "value")));
}

// A name, or in the debug console "NAME := VALUE". For the clipboard: the value alone.
DapSession::Answer DapSession::evaluate(const Json& arguments) {
  const std::string expression = text_in(arguments, "expression");
  const std::string instance = instance_of(number_in(arguments, "frameId"));
  const auto trim = [](std::string_view text) { return std::string(trimmed(text)); };
  const std::size_t assign = expression.find(":=");
  Answer made = Json();
  if (assign != std::string::npos && text_in(arguments, "context") == "repl") {
    made = written(instance, trim(expression.substr(0, assign)), trim(expression.substr(assign + 2)));
  } else {
    PLCHOST_TRY_ASSIGN(const auto variable, link_.variable(instance, trim(expression)));
    made = variable_json(variable, "");
    if (text_in(arguments, "context") == "clipboard") (*made)["value"] = dds::text_of(variable.value);
  }
  if (!made) return made;
  return Json{{"result", (*made)["value"]}, {"type", (*made)["type"]}, {"variablesReference", 0}};
}

}  // namespace plchost
