#include "api/cli/debug/dap_session.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

// Of the source of functions' breakpoints: no path.
constexpr const char* kFunctions = "";
// A frame's number: the thread's, and the place in its stack.
constexpr std::int64_t kFramesOfThread = 1000;

std::int64_t number_in(const Json& arguments, const char* key) {
  const auto found = arguments.find(key);
  return found != arguments.end() && found->is_number_integer() ? found->get<std::int64_t>() : 0;
}

std::string text_in(const Json& arguments, const char* key) {
  const auto found = arguments.find(key);
  return found != arguments.end() && found->is_string() ? found->get<std::string>() : std::string();
}

Json list_in(const Json& arguments, const char* key) {
  const auto found = arguments.find(key);
  return found != arguments.end() && found->is_array() ? *found : Json::array();
}

std::string last_name(std::string_view path) {
  return std::string(path.substr(path.find_last_of("/\\") + 1));
}

Json variable_json(const plc_VariableRecord& variable, std::string_view prefix) {
  std::string name(dds::text_of(variable.name));
  const std::string whole = name;
  if (name.size() > prefix.size() && name.starts_with(prefix)) name.erase(0, prefix.size());
  return {{"name", name},
          {"evaluateName", whole},
          {"value", dds::text_of(variable.value)},
          {"type", dds::text_of(variable.type)},
          {"variablesReference", 0}};
}

}  // namespace

DapSession::~DapSession() {
  (void)link_.detach();
}

void DapSession::event(const std::string& name, Json body) {
  send_({{"seq", sequence_++}, {"type", "event"}, {"event", name}, {"body", std::move(body)}});
}

bool DapSession::obey(const Json& request) {
  const std::string command = text_in(request, "command");
  const auto found = request.find("arguments");
  const Json arguments = found != request.end() && found->is_object() ? *found : Json::object();
  Answer answer = carry_out(command, arguments);
  Json response{{"type", "response"},
                {"request_seq", number_in(request, "seq")},
                {"success", answer.has_value()},
                {"command", command}};
  if (answer) {
    response["body"] = *std::move(answer);
  } else {
    response["message"] = answer.error().describe();
    response["body"] = {{"error",
                         {{"id", 1},
                          {"format", "{_text}"},
                          {"showUser", true},
                          {"variables", {{"_text", answer.error().describe()}}}}}};
  }
  response["seq"] = sequence_++;
  send_(response);
  if (command == "attach" && answer) event("initialized", Json::object());
  return command != "disconnect" && command != "terminate";
}

DapSession::Answer DapSession::carry_out(const std::string& command, const Json& arguments) {
  if (command == "initialize") {
    return Json{{"supportsConfigurationDoneRequest", true},
                {"supportsFunctionBreakpoints", true},
                {"supportsConditionalBreakpoints", true},
                {"supportsHitConditionalBreakpoints", true},
                {"supportsLogPoints", true},
                {"supportsSetVariable", true},
                {"supportsEvaluateForHovers", true},
                {"supportsSingleThreadExecutionRequests", true},
                {"supportTerminateDebuggee", false}};
  }
  if (command == "attach" || command == "launch") {
    if (command == "attach") return attach();
    return failure(ErrorCode::unsupported, "an instance is attached to: use the request 'attach'");
  }
  if (command == "disconnect" || command == "terminate") {
    PLCHOST_TRY(link_.detach());
    return Json::object();
  }
  if (!link_.attached())
    return failure(ErrorCode::wrong_state, "not attached: the request 'attach' comes first");
  using Do = Answer (DapSession::*)(const Json&);
  static const std::map<std::string, Do> kOwn = {
      {"setBreakpoints", &DapSession::set_breakpoints},
      {"setFunctionBreakpoints", &DapSession::set_function_breakpoints},
      {"stackTrace", &DapSession::stack},
      {"scopes", &DapSession::scopes},
      {"variables", &DapSession::variables},
      {"setVariable", &DapSession::set_variable},
      {"evaluate", &DapSession::evaluate},
      {"pause", &DapSession::pause}};
  if (const auto own = kOwn.find(command); own != kOwn.end()) return (this->*own->second)(arguments);
  if (command == "threads") return threads();
  if (command == "configurationDone" || command == "setExceptionBreakpoints") return Json::object();
  if (command == "continue" || command == "next" || command == "stepIn" || command == "stepOut")
    return go_on(command, arguments);
  return failure(ErrorCode::unsupported,
                 fmt::format("'{}' is no request that is served here", shown(command)));
}

DapSession::Answer DapSession::attach() {
  PLCHOST_TRY_ASSIGN(const auto remark, link_.attach(take_));
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  tasks_.clear();
  for (const Json& task : state_.value("tasks", Json::array())) tasks_.push_back(task.value("task", ""));
  if (!remark.empty()) event("output", {{"category", "important"}, {"output", remark + "\n"}});
  return Json::object();
}

void DapSession::remove_of(const std::string& key) {
  for (const std::uint32_t id : std::exchange(ids_[key], {}))
    (void)link_.command(fmt::format("delete {}", id));
}

Json DapSession::set_one(const std::string& key, const std::string& place, const Json& wanted) {
  std::string order = "break " + place;
  if (const auto hits = text_in(wanted, "hitCondition"); !hits.empty()) order += " hits " + hits;
  if (const auto condition = text_in(wanted, "condition"); !condition.empty()) order += " if " + condition;
  if (const auto log = text_in(wanted, "logMessage"); !log.empty()) order += " log " + log;
  const auto answer = link_.command(order);
  if (!answer) return {{"verified", false}, {"message", answer.error().describe()}};
  const auto id = answer->value("id", 0U);
  ids_[key].push_back(id);
  if (const auto remark = answer->value("remark", ""); !remark.empty())
    event("output", {{"category", "important"}, {"output", remark + "\n"}});
  return {{"verified", true}, {"id", id}, {"line", answer->value("line", 0)}};
}

// All of a source, in the place of those before.
DapSession::Answer DapSession::set_breakpoints(const Json& arguments) {
  const Json source = arguments.value("source", Json::object());
  const std::string path =
      text_in(source, "path").empty() ? text_in(source, "name") : text_in(source, "path");
  if (path.empty()) return failure(ErrorCode::invalid_argument, "the source has no path and no name");
  remove_of(path);
  Json made = Json::array();
  for (const Json& wanted : list_in(arguments, "breakpoints")) {
    made.push_back(set_one(path, fmt::format("{}:{}", last_name(path), number_in(wanted, "line")), wanted));
  }
  return Json{{"breakpoints", std::move(made)}};
}

DapSession::Answer DapSession::set_function_breakpoints(const Json& arguments) {
  remove_of(kFunctions);
  Json made = Json::array();
  for (const Json& wanted : list_in(arguments, "breakpoints"))
    made.push_back(set_one(kFunctions, text_in(wanted, "name"), wanted));
  return Json{{"breakpoints", std::move(made)}};
}

DapSession::Answer DapSession::threads() {
  Json threads = Json::array();
  for (std::size_t i = 0; i < tasks_.size(); ++i) threads.push_back({{"id", i + 1}, {"name", tasks_[i]}});
  return Json{{"threads", std::move(threads)}};
}

Result<std::string> DapSession::task_of(const Json& arguments) {
  const std::int64_t thread = number_in(arguments, "threadId");
  if (thread >= 1 && static_cast<std::size_t>(thread) <= tasks_.size())
    return tasks_[static_cast<std::size_t>(thread - 1)];
  return failure(ErrorCode::invalid_argument,
                 fmt::format("no thread {}: there are 1 to {}", thread, tasks_.size()));
}

DapSession::Answer DapSession::stack(const Json& arguments) {
  PLCHOST_TRY_ASSIGN(const auto name, task_of(arguments));
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  const std::int64_t thread = number_in(arguments, "threadId");
  Json frames = Json::array();
  for (const Json& task : state_.value("tasks", Json::array())) {
    if (task.value("task", "") != name) continue;
    for (const Json& frame : task.value("stack", Json::array())) {
      const std::string file = frame.value("file", "");
      frames.push_back({{"id", thread * kFramesOfThread + static_cast<std::int64_t>(frames.size())},
                        {"name", frame.value("pou", "")},
                        {"line", frame.value("line", 0)},
                        {"column", 1},
                        {"source", {{"name", last_name(file)}, {"path", file}}}});
    }
  }
  const std::size_t total = frames.size();
  return Json{{"stackFrames", std::move(frames)}, {"totalFrames", total}};
}

std::string DapSession::instance_of(std::int64_t frame) const {
  const auto thread = static_cast<std::size_t>(frame / kFramesOfThread);
  const auto place = static_cast<std::size_t>(frame % kFramesOfThread);
  if (frame <= 0 || thread < 1 || thread > tasks_.size()) return {};
  for (const Json& task : state_.value("tasks", Json::array())) {
    if (task.value("task", "") != tasks_[thread - 1]) continue;
    const Json stack = task.value("stack", Json::array());
    return place < stack.size() ? stack[place].value("instance", "") : std::string();
  }
  return {};
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
  PLCHOST_TRY_ASSIGN(const auto variable, link_.variable(instance, name));
  const std::string whole(dds::text_of(variable.name));
  PLCHOST_TRY(link_.write(fmt::format("{}={}", whole, value)));
  PLCHOST_TRY_ASSIGN(const auto now, link_.variable("", whole));
  return variable_json(now, "");
}

DapSession::Answer DapSession::set_variable(const Json& arguments) {
  return written(instance_of(number_in(arguments, "variablesReference")), text_in(arguments, "name"),
                 text_in(arguments, "value"));
}

// A name, or in the debug console "NAME := VALUE".
DapSession::Answer DapSession::evaluate(const Json& arguments) {
  std::string expression = text_in(arguments, "expression");
  const std::string instance = instance_of(number_in(arguments, "frameId"));
  const auto trim = [](std::string text) {
    const auto first = text.find_first_not_of(' ');
    if (first == std::string::npos) return std::string();
    return text.substr(first, text.find_last_not_of(' ') - first + 1);
  };
  const std::size_t assign = expression.find(":=");
  Answer made = Json();
  if (assign != std::string::npos && text_in(arguments, "context") == "repl") {
    made = written(instance, trim(expression.substr(0, assign)), trim(expression.substr(assign + 2)));
  } else {
    PLCHOST_TRY_ASSIGN(const auto variable, link_.variable(instance, trim(expression)));
    made = variable_json(variable, "");
  }
  if (!made) return made;
  return Json{{"result", (*made)["value"]}, {"type", (*made)["type"]}, {"variablesReference", 0}};
}

DapSession::Answer DapSession::go_on(const std::string& command, const Json& arguments) {
  static const std::map<std::string, std::string> kWords = {
      {"continue", "continue"}, {"next", "next"}, {"stepIn", "step"}, {"stepOut", "out"}};
  PLCHOST_TRY_ASSIGN(const auto task, task_of(arguments));
  PLCHOST_TRY(link_.command(fmt::format("{} {}", kWords.at(command), task)));
  if (command == "continue") return Json{{"allThreadsContinued", false}};
  return Json::object();
}

DapSession::Answer DapSession::pause(const Json& arguments) {
  PLCHOST_TRY_ASSIGN(const auto task, task_of(arguments));
  PLCHOST_TRY(link_.command("pause " + task));
  return Json::object();
}

void DapSession::tell_halts(const Json& state) {
  for (const Json& task : state.value("tasks", Json::array())) {
    if (task.value("state", "") != "halted") continue;
    const std::string name = task.value("task", "");
    const auto halt = task.value("halt", std::uint64_t{0});
    if (std::exchange(told_[name], halt) == halt) continue;
    const auto thread = std::ranges::find(tasks_, name) - tasks_.begin() + 1;
    Json body{{"reason", task.value("reason", "")}, {"threadId", thread}, {"allThreadsStopped", false}};
    if (task.contains("breakpoint")) body["hitBreakpointIds"] = Json::array({task["breakpoint"]});
    event("stopped", std::move(body));
  }
}

Result<void> DapSession::look() {
  if (!link_.attached()) return {};
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  for (const Json& line : state_.value("log", Json::array())) {
    const auto number = line.value("number", std::uint64_t{0});
    if (number <= logged_) continue;
    logged_ = number;
    event("output", {{"category", "console"}, {"output", line.value("text", "") + "\n"}});
  }
  tell_halts(state_);
  return {};
}

}  // namespace plchost
