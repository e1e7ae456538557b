#include "api/cli/debug/debug_console.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <functional>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "api/cli/interrupt.hpp"
#include "api/cli/rows/variable_rows.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

constexpr auto kLook = std::chrono::milliseconds(20);
constexpr auto kStepPatience = std::chrono::seconds(5);
constexpr double kWaitSeconds = 10;

constexpr std::array kCommands = {
    "break PLACE [hits COUNT] [if CONDITION] [log TEXT]",
    "  PLACE is POU:LINE, FILE:LINE or POU; \"MY FILE\":LINE with blanks. COUNT is =N, %N or >=N.",
    "delete ID|*             list                        tasks",
    "continue [TASK|*]       pause [TASK|*]              wait [SECONDS]",
    "step [TASK]             next [TASK]                 out [TASK]          until PLACE",
    "stack [TASK]            print [NAME]                set NAME=VALUE      task NAME",
    "frame [N]               up [N]                      down [N]            the frame of print and set",
    "halts all|one           help                        quit"};

std::string place_text(const Json& frame) {
  return fmt::format("{}:{} ({}){}", frame.value("pou", ""), frame.value("line", 0U), frame.value("file", ""),
                     frame.contains("instance") ? "  " + frame.value("instance", "") : std::string());
}

std::string frame_text(std::size_t number, const Json& frame) {
  return fmt::format("#{} {}", number, place_text(frame));
}

void print_line(std::string_view text) {
  fmt::print("{}\n", printable(std::string(text)));
  std::fflush(stdout);
}

void print_halt(const Json& task) {
  std::string why = task.value("reason", "");
  if (task.contains("breakpoint")) why += fmt::format(" {}", task.value("breakpoint", 0U));
  const Json stack = task.value("stack", Json::array());
  print_line(fmt::format("task {} halts: {} at {}", task.value("task", ""), why,
                         stack.empty() ? std::string("?") : place_text(stack.front())));
}

void print_local(const Json& local) {
  print_line(fmt::format("{} = {}", local.value("name", ""), value_of_local(local)));
}

void print_variable(const plc_VariableRecord& variable) {
  const std::string_view forced = forced_text(variable);
  print_line(fmt::format("{} = {}{}{}", dds::text_of(variable.name), dds::text_of(variable.value),
                         forced.empty() ? "" : "  ", forced));
}

}  // namespace

void DebugConsole::say(const Result<void>& done) {
  if (done) return;
  failed_ = true;
  std::fflush(stdout);
  fmt::print(stderr, "plcctl: {}\n", printable(done.error().describe()));
}

bool DebugConsole::obey(std::string_view line) {
  while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
  while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
  if (line.empty() || line.front() == '#') return true;
  const std::size_t space = std::min(line.find(' '), line.size());
  const auto verb = line.substr(0, space);
  const std::string rest(line.substr(std::min(space + 1, line.size())));
  if (verb == "quit" || verb == "exit") return false;
  say(carry_out(verb, rest));
  return true;
}

Result<void> DebugConsole::carry_out(std::string_view verb, const std::string& rest) {
  using Do = std::function<Result<void>(DebugConsole&, const std::string&)>;
  static const std::map<std::string_view, Do, std::less<>> own_commands = {
      {"break", &DebugConsole::add_breakpoint},
      {"list", [](auto& self, const auto&) { return self.list(); }},
      {"tasks", [](auto& self, const auto&) { return self.tasks(); }},
      {"stack", &DebugConsole::stack},
      {"frame", [](auto& self, const auto& number) { return self.choose_frame("frame", number); }},
      {"up", [](auto& self, const auto& count) { return self.choose_frame("up", count); }},
      {"down", [](auto& self, const auto& count) { return self.choose_frame("down", count); }},
      {"print", &DebugConsole::print},
      {"set", &DebugConsole::set},
      {"wait", &DebugConsole::wait},
      {"task", [](auto& self, const auto& name) { return self.choose(name); }},
      {"help", [](auto&, const auto&) {
         fmt::print("{}\n", fmt::join(kCommands, "\n"));
         return Result<void>();
       }}};
  if (const auto own = own_commands.find(verb); own != own_commands.end()) return own->second(*this, rest);
  static constexpr std::array kSteps = {"continue", "pause", "step", "next", "out", "until"};
  if (std::ranges::find(kSteps, verb) != kSteps.end()) return go_on(verb, rest);
  if (verb == "delete" || verb == "halts") {
    PLCHOST_TRY(link_.command(fmt::format("{} {}", verb, rest)));
    if (verb == "delete") has_deleted(rest);
    return {};
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is no command; 'help' lists them", shown(verb)));
}

void DebugConsole::has_deleted(const std::string& ids) {
  if (ids == "*") return news_.has_deleted_all();
  std::uint32_t id = 0;
  (void)std::from_chars(ids.data(), ids.data() + ids.size(), id);
  news_.has_deleted(id);
}

Result<void> DebugConsole::add_breakpoint(const std::string& rest) {
  PLCHOST_TRY_ASSIGN(const auto answer, link_.command("break " + rest));
  const auto id = answer.value("id", 0U);
  news_.has_set(id, answer.value("line", std::int64_t{0}));
  print_line(fmt::format("breakpoint {} at {}", id, place_text(answer)));
  if (const std::string remark = answer.value("remark", ""); !remark.empty()) print_line(remark);
  return {};
}

Result<void> DebugConsole::list() {
  PLCHOST_TRY(look());
  for (const Json& one : state_.value("breakpoints", Json::array())) {
    std::string text = fmt::format("breakpoint {} at {}  hits {}", one.value("id", 0U), place_text(one),
                                   one.value("hits", std::uint64_t{0}));
    for (const auto& [key, word] :
         {std::pair("hit_rule", "hits"), std::pair("condition", "if"), std::pair("log", "log")}) {
      if (one.contains(key)) text += fmt::format("  {} {}", word, one.value(key, ""));
    }
    print_line(text);
  }
  if (const std::string missing = state_.value("left_out", ""); !missing.empty())
    print_line(fmt::format("too long to be told: {}", missing));
  return {};
}

Result<void> DebugConsole::tasks() {
  PLCHOST_TRY(look());
  for (const Json& task : state_.value("tasks", Json::array())) {
    std::string text = fmt::format("task {}  {}", task.value("task", ""), task.value("state", ""));
    if (task.contains("halts")) {
      text += fmt::format("  halts {}, {} ms, {} passed meanwhile", task.value("halts", std::uint64_t{0}),
                          task.value("halted_ms", std::int64_t{0}),
                          count_text(task.value("releases_halted", std::uint64_t{0}), "release"));
    }
    const Json stack = task.value("stack", Json::array());
    if (!stack.empty()) text += "  at " + place_text(stack.front());
    print_line(text);
  }
  return {};
}

Result<void> DebugConsole::choose(const std::string& task) {
  PLCHOST_TRY(look());
  if (task_in(state_, task) == nullptr)
    return failure(ErrorCode::not_found, fmt::format("no task '{}'", shown(task)));
  mean(task);
  return {};
}

Result<std::string> DebugConsole::task_or_current(const std::string& named) {
  if (!named.empty()) return named;
  PLCHOST_TRY(look());
  const Json* const current = task_in(state_, task_);
  if (current != nullptr && current->value("state", "") == "halted") return task_;
  for (const Json& task : state_.value("tasks", Json::array())) {
    if (task.value("state", "") == "halted") return task.value("task", "");
  }
  return failure(ErrorCode::wrong_state, "no task halts; name one");
}

Result<void> DebugConsole::stack(const std::string& task) {
  PLCHOST_TRY_ASSIGN(const auto name, task_or_current(task));
  PLCHOST_TRY(look());
  const Json* const found = task_in(state_, name);
  if (found == nullptr || !found->contains("stack"))
    return failure(ErrorCode::wrong_state, fmt::format("task '{}' does not halt", shown(name)));
  std::size_t number = 0;
  for (const Json& frame : (*found)["stack"]) print_line(frame_text(number++, frame));
  mean(name);
  return {};
}

void DebugConsole::mean(const std::string& task) {
  if (std::exchange(task_, task) != task) frame_ = 0;
}

Json DebugConsole::current_stack() const {
  const Json* const task = task_in(state_, task_);
  return task == nullptr ? Json::array() : task->value("stack", Json::array());
}

// "frame N", and "up N" and "down N" from the frame that is chosen.
Result<void> DebugConsole::choose_frame(std::string_view verb, const std::string& number) {
  PLCHOST_TRY_ASSIGN(const auto task, task_or_current(""));
  mean(task);
  std::int64_t wanted = verb == "frame" ? frame_ : 1;
  if (!number.empty()) {
    std::uint32_t given = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), given);
    if (error != std::errc{} || end != number.data() + number.size()) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("'{}' is no number of a frame, or of frames", shown(number)));
    }
    wanted = given;
  }
  if (verb == "up") wanted = frame_ + wanted;
  if (verb == "down") wanted = frame_ - wanted;
  const Json stack = current_stack();
  if (wanted < 0 || std::cmp_greater_equal(wanted, stack.size())) {
    return failure(ErrorCode::not_found,
                   fmt::format("no frame {}: task '{}' has the frames 0 to {}", wanted, shown(task_),
                               static_cast<std::int64_t>(stack.size()) - 1));
  }
  frame_ = wanted;
  const auto place = static_cast<std::size_t>(frame_);
  print_line(frame_text(place, stack[place]));
  return {};
}

// A state that is too long to be told has fewer frames than the stack.
Result<Json> DebugConsole::current_frame() const {
  const Json stack = current_stack();
  if (stack.empty()) return Json::object();
  const auto place = static_cast<std::size_t>(frame_);
  if (place < stack.size()) return stack[place];
  return failure(ErrorCode::wrong_state,
                 fmt::format("frame {} of task '{}' is not told at present; ask again, or choose another one",
                             frame_, shown(task_)));
}

Result<void> DebugConsole::print(const std::string& name) {
  PLCHOST_TRY(look());
  PLCHOST_TRY_ASSIGN(const auto frame, current_frame());
  if (name.empty()) return print_all(frame);
  if (name.find_first_of("*?") != std::string::npos) return print_variables(name);
  PLCHOST_TRY_ASSIGN(const auto local, local_in(frame, name));
  if (!local.is_null()) {
    print_local(local);
    return {};
  }
  const auto one = link_.variable(frame.value("instance", ""), name);
  if (!one) return std::unexpected(error_in_frame(frame, one.error()));
  print_variable(*one);
  return {};
}

// The local variables first.
Result<void> DebugConsole::print_all(const Json& frame) {
  const std::string instance = frame.value("instance", "");
  const Json locals = frame.value("locals", Json::array());
  for (const Json& local : locals) print_local(local);
  const bool left_out = frame.contains("locals_left_out");
  if (left_out) print_line("the local variables of this call are too long to be told with all others");
  if (!instance.empty()) return print_variables(instance + ".*");
  if (!locals.empty() || left_out) return {};
  return failure(ErrorCode::wrong_state,
                 "no task halts where there are variables; name one, or go 'up' to a caller");
}

Result<void> DebugConsole::print_variables(const std::string& pattern) {
  PLCHOST_TRY_ASSIGN(const auto found, link_.variables(pattern));
  for (const auto& variable : found) print_variable(variable);
  return {};
}

Result<void> DebugConsole::set(const std::string& order) {
  const std::size_t equal = order.find('=');
  if (equal == std::string::npos || equal == 0)
    return failure(ErrorCode::invalid_argument, fmt::format("'{}' is not NAME=VALUE", shown(order)));
  PLCHOST_TRY(look());
  std::string name = order.substr(0, equal);
  while (!name.empty() && name.back() == ' ') name.pop_back();
  std::size_t begin = equal + 1;
  while (begin < order.size() && order[begin] == ' ') ++begin;
  const std::string value = order.substr(begin);
  PLCHOST_TRY_ASSIGN(const auto frame, current_frame());
  PLCHOST_TRY_ASSIGN(const auto local, local_in(frame, name));
  if (!local.is_null()) {
    PLCHOST_TRY(link_.write_local(task_, frame_, name, value));
  } else {
    PLCHOST_TRY_ASSIGN(name, link_.write(frame.value("instance", ""), name, value));
  }
  return print(name);
}

Result<void> DebugConsole::go_on(std::string_view verb, const std::string& rest) {
  const bool steps = verb != "continue" && verb != "pause";
  std::string task = verb == "until" ? std::string() : rest;
  if (steps) {
    PLCHOST_TRY_ASSIGN(task, task_or_current(task));
  } else if (task.empty()) {
    task = "*";
  }
  PLCHOST_TRY(look());
  pass_halts_of(task);
  PLCHOST_TRY_ASSIGN(const auto answer, link_.command(verb == "until" ? fmt::format("until {} {}", task, rest)
                                                                      : fmt::format("{} {}", verb, task)));
  if (const std::string remark = answer.value("remark", ""); !remark.empty()) print_line(remark);
  return steps ? wait_for_halt(task, kStepPatience) : Result<void>();
}

// Those of other tasks are still to be waited for.
void DebugConsole::pass_halts_of(const std::string& task) {
  for (const auto& [name, halts] : news_.told()) {
    if (task == "*" || task == name) passed_[name] = halts;
  }
}

Result<void> DebugConsole::wait(const std::string& seconds) {
  double given = kWaitSeconds;
  if (!seconds.empty()) {
    const auto [end, error] = std::from_chars(seconds.data(), seconds.data() + seconds.size(), given);
    if (error != std::errc{} || end != seconds.data() + seconds.size() || !(given >= 0 && given <= 86400)) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("'{}' is no number of seconds from 0 to 86400", shown(seconds)));
    }
  }
  return wait_for_halt("", std::chrono::duration_cast<Duration>(std::chrono::duration<double>(given)));
}

// A halt since the last go_on() counts, also one that was told while no command came. A task that is named is
// let go before this.
Result<void> DebugConsole::wait_for_halt(const std::string& task, Duration patience) {
  const TimePoint end = MonotonicClock::now() + patience;
  for (;;) {
    PLCHOST_TRY(look());
    const bool halted = std::ranges::any_of(news_.told(), [&](const auto& entry) {
      const auto known = passed_.find(entry.first);
      return (task.empty() || task == entry.first) &&
             (known == passed_.end() || known->second != entry.second);
    });
    if (halted) {
      pass_halts_of(task.empty() ? "*" : task);
      return {};
    }
    if (MonotonicClock::now() >= end || interrupted()) {
      return failure(ErrorCode::timed_out, fmt::format("{} within {:.1f} s",
                                                       task.empty() ? "no further task has halted"
                                                                    : "task '" + task + "' has not halted",
                                                       std::chrono::duration<double>(patience).count()));
    }
    std::this_thread::sleep_for(kLook);
  }
}

void DebugConsole::take(const Json& state) {
  state_ = state;
  for (const auto& line : news_.lines(state)) print_line(line.is_gap ? line.text : "log: " + line.text);
  for (const DebugNews::Moved& moved : news_.moved(state)) {
    print_line(moved.line ? fmt::format("breakpoint {} is in line {} now", moved.id, *moved.line)
                          : fmt::format("breakpoint {} is gone: the application has no such place any more",
                                        moved.id));
  }
  for (const std::string& task : news_.ignoring(state)) print_line(ignoring_text(task));
  for (const Json& task : news_.halts(state)) {
    task_ = task.value("task", "");
    frame_ = 0;
    print_halt(task);
  }
}

Result<void> DebugConsole::look() {
  PLCHOST_TRY_ASSIGN(const auto state, link_.state());
  take(state);
  return {};
}

}  // namespace plchost
