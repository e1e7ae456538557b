// A DapSession's breakpoints, stacks and steps; its values are in dap_values.cpp.
#include "api/cli/debug/dap_session.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "api/cli/debug/foreign_json.hpp"
#include "shm/base/names.hpp"
#include "shm/base/path_parts.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

// Of the source of functions' breakpoints: no path.
constexpr const char* kFunctions = "";

Json list_in(const Json& arguments, const char* key) {
  const auto found = arguments.find(key);
  return found != arguments.end() && found->is_array() ? *found : Json::array();
}

// A part of a command, which is words with blanks between. Empty: it is not there.
Result<std::string> part_in(const Json& wanted, const char* key) {
  const auto found = wanted.find(key);
  if (found == wanted.end() || found->is_null()) return std::string();
  if (!found->is_string()) return failure(ErrorCode::invalid_argument, fmt::format("{} is no text", key));
  auto text = found->get<std::string>();
  if (!is_printable_utf8(text))
    return failure(ErrorCode::invalid_argument, fmt::format("{} has characters that cannot be printed", key));
  return text;
}

// Only the last part of a command may have the words of the others in it.
Result<std::string> inner_part_in(const Json& wanted, const char* key) {
  PLCHOST_TRY_ASSIGN(auto text, part_in(wanted, key));
  for (const std::string_view word : {" hits ", " if ", " log "}) {
    if (text.find(word) != std::string::npos)
      return failure(ErrorCode::invalid_argument, fmt::format("{}: '{}' is not allowed in it", key, word));
  }
  return text;
}

// The words of a command have blanks between, so the name of a POU can have none.
Result<std::string> pou_in(std::string_view text) {
  std::string place(trimmed(text));
  if (!place.empty() && place.find(' ') == std::string::npos && is_printable_utf8(place)) return place;
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is no name of a POU, which is one word of characters that can be printed",
                             shown(text)));
}

// " hits COUNT if CONDITION log TEXT"
Result<std::string> parts_of(const Json& wanted) {
  PLCHOST_TRY_ASSIGN(const auto hits, inner_part_in(wanted, "hitCondition"));
  PLCHOST_TRY_ASSIGN(const auto condition, inner_part_in(wanted, "condition"));
  PLCHOST_TRY_ASSIGN(const auto log, part_in(wanted, "logMessage"));
  std::string order;
  if (!hits.empty()) order += " hits " + hits;
  if (!condition.empty()) order += " if " + condition;
  if (!log.empty()) order += " log " + log;
  return order;
}

std::string last_name(std::string_view path) {
  return std::string(path.substr(path.find_last_of("/\\") + 1));
}

// As the instance is asked for a source: by the whole path, as several may have one name. It knows no path
// with backslashes.
std::string asked_path(const std::string& path) {
  return path.find('\\') == std::string::npos ? path : last_name(path);
}

Result<std::string> file_in(const std::string& path) {
  if (!path.empty() && is_printable_utf8(path) && path.find('"') == std::string::npos) return path;
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is no name of a file, which has characters that can be printed and no "
                             "quotation marks",
                             shown(path)));
}

// Blanks end a place that has no quotation marks.
std::string file_place(std::string_view file, std::int64_t line) {
  if (file.find(' ') == std::string_view::npos) return fmt::format("{}:{}", file, line);
  return fmt::format("\"{}\":{}", file, line);
}

// Of a stack: from "startFrame" on, and as many as "levels" says; 0 means all.
Json part_of(Json frames, const Json& arguments) {
  const auto size = static_cast<std::int64_t>(frames.size());
  const std::int64_t first = std::clamp<std::int64_t>(number_in(arguments, "startFrame"), 0, size);
  const std::int64_t levels = number_in(arguments, "levels");
  const std::int64_t last = levels > 0 && levels < size - first ? first + levels : size;
  frames.erase(frames.begin() + last, frames.end());
  frames.erase(frames.begin(), frames.begin() + first);
  return frames;
}

// An order has a greatest length, and the last parts of a path tell most.
std::string without_first_folders(std::string_view path, std::size_t most) {
  while (path.size() > most) {
    const std::size_t next = path.find('/', 1);
    if (next == std::string_view::npos) break;
    path.remove_prefix(next);
  }
  return std::string(path);
}

// Of an order: the verb, the number of the session, and the number of the line, with blanks and quotation
// marks.
constexpr std::size_t kOrderFrame = 40;

}  // namespace

DapSession::~DapSession() {
  (void)link_.detach();
}

void DapSession::event(const std::string& name, Json body) {
  send_({{"seq", sequence_++}, {"type", "event"}, {"event", name}, {"body", std::move(body)}});
}

void DapSession::tell(const std::string& category, const std::string& text) {
  event("output", {{"category", category}, {"output", text + "\n"}});
}

bool DapSession::obey(const Json& request) {
  const std::string command = text_in(request, "command");
  const auto found = request.find("arguments");
  const Json arguments = found != request.end() && found->is_object() ? *found : Json::object();
  Answer answer = carry_out(command, arguments);
  const bool done = answer.has_value();
  Json response{{"type", "response"},
                {"request_seq", number_in(request, "seq")},
                {"success", done},
                {"command", command}};
  if (done) {
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
  if (command == "attach" && done) event("initialized", Json::object());
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
                {"supportsClipboardContext", true},
                {"supportsSingleThreadExecutionRequests", true},
                {"supportTerminateDebuggee", false}};
  }
  if (command == "attach" || command == "launch") {
    if (command == "attach") return attach(arguments);
    return failure(ErrorCode::unsupported, "an instance is attached to: use the request 'attach'");
  }
  if (command == "disconnect" || command == "terminate") {
    PLCHOST_TRY(link_.detach());
    return Json::object();
  }
  if (!link_.attached())
    return failure(ErrorCode::wrong_state, "not attached: the request 'attach' comes first");
  using Do = Answer (DapSession::*)(const Json&);
  static const std::map<std::string, Do> own_requests = {
      {"setBreakpoints", &DapSession::set_breakpoints},
      {"setFunctionBreakpoints", &DapSession::set_function_breakpoints},
      {"stackTrace", &DapSession::stack},
      {"scopes", &DapSession::scopes},
      {"variables", &DapSession::variables},
      {"setVariable", &DapSession::set_variable},
      {"evaluate", &DapSession::evaluate},
      {"pause", &DapSession::pause}};
  if (const auto own = own_requests.find(command); own != own_requests.end())
    return (this->*own->second)(arguments);
  if (command == "threads") return threads();
  if (command == "configurationDone" || command == "setExceptionBreakpoints") return Json::object();
  if (command == "continue" || command == "next" || command == "stepIn" || command == "stepOut")
    return go_on(command, arguments);
  return failure(ErrorCode::unsupported,
                 fmt::format("'{}' is no request that is served here", shown(command)));
}

DapSession::Answer DapSession::attach(const Json& arguments) {
  if (link_.attached()) return failure(ErrorCode::wrong_state, "attached already");
  PLCHOST_TRY_ASSIGN(const auto remark, link_.attach(take_));
  const auto all = arguments.find("haltAllTasks");
  halts_all_ = all != arguments.end() && *all == true;
  if (halts_all_) {
    PLCHOST_TRY(link_.command("halts all"));
  }
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  tasks_.clear();
  news_ = {};
  halted_.clear();
  for (const Json& task : state_.value("tasks", Json::array())) tasks_.push_back(task.value("task", ""));
  if (!remark.empty()) tell("important", remark);
  return Json::object();
}

Result<void> DapSession::remove_of(const std::string& key) {
  std::vector<std::uint32_t>& ids = ids_[key];
  while (!ids.empty()) {
    // One whose place is gone since an online change is no more.
    PLCHOST_TRY(if_found(link_.command(fmt::format("delete {}", ids.back()))));
    news_.has_deleted(ids.back());
    ids.pop_back();
  }
  return {};
}

Json DapSession::set_one(const std::string& key, const Result<std::string>& place, const Json& wanted) {
  const auto parts = parts_of(wanted);
  const auto& checked = place ? parts : place;
  if (!checked) return {{"verified", false}, {"message", checked.error().describe()}};
  const std::int64_t line = number_in(wanted, "line");
  const bool in_file = key != kFunctions;
  const std::size_t room = kMaxArgument - std::min(kMaxArgument, kOrderFrame + parts->size());
  const std::string whole = in_file ? file_place(without_first_folders(*place, room), line) : *place;
  const auto answer = link_.command(fmt::format("break {}{}", whole, *parts));
  if (!answer) return {{"verified", false}, {"message", answer.error().describe()}};
  const auto id = answer->value("id", 0U);
  const auto place_line = answer->value("line", std::int64_t{0});
  ids_[key].push_back(id);
  news_.has_set(id, place_line);
  if (const auto file = answer->value("file", ""); sources_.contains(key) && !file.empty())
    paths_[file] = key;
  if (const auto remark = answer->value("remark", ""); !remark.empty()) tell("important", remark);
  return {{"verified", true}, {"id", id}, {"line", place_line}};
}

// All of a source, in the place of those before.
DapSession::Answer DapSession::set_breakpoints(const Json& arguments) {
  const Json source = arguments.value("source", Json::object());
  const std::string whole = text_in(source, "path");
  const std::string path = whole.empty() ? text_in(source, "name") : whole;
  if (path.empty()) return failure(ErrorCode::invalid_argument, "the source has no path and no name");
  PLCHOST_TRY(remove_of(path));
  if (!whole.empty()) sources_.insert(whole);
  const auto file = file_in(asked_path(path));
  Json made = Json::array();
  for (const Json& wanted : list_in(arguments, "breakpoints")) made.push_back(set_one(path, file, wanted));
  return Json{{"breakpoints", std::move(made)}};
}

DapSession::Answer DapSession::set_function_breakpoints(const Json& arguments) {
  PLCHOST_TRY(remove_of(kFunctions));
  Json made = Json::array();
  for (const Json& wanted : list_in(arguments, "breakpoints"))
    made.push_back(set_one(kFunctions, pou_in(text_in(wanted, "name")), wanted));
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

// A source in which a breakpoint was set is that file. Others are the file that they agree with most.
std::string DapSession::path_of(const std::string& file) const {
  if (const auto known = paths_.find(file); known != paths_.end()) return known->second;
  std::size_t most = 0;
  std::string best = file;
  for (const std::string& path : sources_) {
    if (std::ranges::any_of(paths_, [&](const auto& entry) { return entry.second == path; })) continue;
    const std::size_t common =
        std::max(common_last_parts(file, path), std::size_t{last_name(file) == last_name(path)});
    if (common > most) best = path;
    most = std::max(most, common);
  }
  return best;
}

DapSession::Answer DapSession::stack(const Json& arguments) {
  PLCHOST_TRY_ASSIGN(const auto name, task_of(arguments));
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  const std::int64_t thread = number_in(arguments, "threadId");
  Json frames = Json::array();
  const Json* const task = task_in(state_, name);
  for (const Json& frame : task == nullptr ? Json::array() : task->value("stack", Json::array())) {
    const std::string file = frame.value("file", "");
    frames.push_back({{"id", thread * kFramesOfThread + static_cast<std::int64_t>(frames.size())},
                      {"name", frame.value("pou", "")},
                      {"line", frame.value("line", 0)},
                      {"column", 1},
                      {"source", {{"name", last_name(file)}, {"path", path_of(file)}}}});
  }
  const std::size_t total = frames.size();
  return Json{{"stackFrames", part_of(std::move(frames), arguments)}, {"totalFrames", total}};
}

DapSession::Answer DapSession::go_on(const std::string& command, const Json& arguments) {
  static const std::map<std::string, std::string> words = {
      {"continue", "continue"}, {"next", "next"}, {"stepIn", "step"}, {"stepOut", "out"}};
  PLCHOST_TRY_ASSIGN(const auto task, task_of(arguments));
  const bool alone = !halts_all_ || arguments.value("singleThread", Json()) == true;
  if (command == "continue" && !alone) {
    PLCHOST_TRY(link_.command("continue *"));
    halted_.clear();
    return Json{{"allThreadsContinued", true}};
  }
  if (!alone) {
    PLCHOST_TRY(let_others_go(task));
  }
  PLCHOST_TRY(link_.command(fmt::format("{} {}", words.at(command), task)));
  halted_.erase(task);
  if (command == "continue") return Json{{"allThreadsContinued", false}};
  return Json::object();
}

// The end of the step halts them again. A step that will be refused lets none of them go.
Result<void> DapSession::let_others_go(const std::string& task) {
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  const Json* const own = task_in(state_, task);
  if (own == nullptr || own->value("state", "") != "halted")
    return failure(ErrorCode::wrong_state, fmt::format("task '{}' does not halt", shown(task)));
  for (const Json& other : state_.value("tasks", Json::array())) {
    const std::string name = other.value("task", "");
    if (name == task || other.value("state", "") != "halted") continue;
    const auto done = link_.command("continue " + name);
    if (!done && done.error().code != ErrorCode::wrong_state) return std::unexpected(done.error());
  }
  return {};
}

DapSession::Answer DapSession::pause(const Json& arguments) {
  PLCHOST_TRY_ASSIGN(const auto task, task_of(arguments));
  PLCHOST_TRY_ASSIGN(const auto answer, link_.command("pause " + task));
  if (answer.value("paused", 0U) > 0) return Json::object();
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  const Json* const now = task_in(state_, task);
  if (now != nullptr && now->value("state", "") == "ignored")
    return failure(ErrorCode::unsupported, answer.value("remark", ""));
  return Json::object();
}

std::int64_t DapSession::thread_of(const std::string& task) const {
  return std::ranges::find(tasks_, task) - tasks_.begin() + 1;
}

void DapSession::tell_halt(const Json& task) {
  const std::string name = task.value("task", "");
  Json body{
      {"reason", task.value("reason", "")}, {"threadId", thread_of(name)}, {"allThreadsStopped", false}};
  if (task.contains("breakpoint")) body["hitBreakpointIds"] = Json::array({task["breakpoint"]});
  event("stopped", std::move(body));
  halted_.insert(name);
}

// A stop, another scheduler and a change of the application let them go.
void DapSession::tell_those_that_go_on() {
  for (auto at = halted_.begin(); at != halted_.end();) {
    const Json* const task = task_in(state_, *at);
    if (task != nullptr && task->value("state", "") == "halted") {
      ++at;
      continue;
    }
    event("continued", {{"threadId", thread_of(*at)}, {"allThreadsContinued", false}});
    at = halted_.erase(at);
  }
}

void DapSession::tell_changes() {
  for (const DebugNews::Moved& moved : news_.moved(state_)) {
    Json breakpoint{{"id", moved.id}, {"verified", moved.line.has_value()}};
    if (moved.line) {
      breakpoint["line"] = *moved.line;
    } else {
      breakpoint["message"] = "it is gone: the application has no such place any more";
    }
    event("breakpoint", {{"reason", "changed"}, {"breakpoint", std::move(breakpoint)}});
  }
  for (const std::string& task : news_.ignoring(state_)) tell("important", ignoring_text(task));
}

Result<void> DapSession::look() {
  if (!link_.attached()) return {};
  PLCHOST_TRY_ASSIGN(state_, link_.state());
  for (const auto& line : news_.lines(state_)) tell(line.is_gap ? "important" : "console", line.text);
  tell_changes();
  tell_those_that_go_on();
  for (const Json& task : news_.halts(state_)) tell_halt(task);
  return {};
}

}  // namespace plchost
