#include "instances/runtime/debug/debug_service.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/eventfd.h>
#include <unistd.h>

#include "instances/plc_debug.h"
#include "instances/runtime/debug/debug_answer.hpp"
#include "instances/runtime/debug/debug_words.hpp"
#include "schedulers/policies/registry.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/log/log.hpp"

// Each statement of a debug build reads it, and the debugger alone writes it: so it is no function of abi/.
unsigned int plc_debug_armed = 0;

namespace plchost {

Result<void> DebugService::attach(Program program) {
  PLCHOST_TRY_ASSIGN(const int fd, check_errno(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK),
                                               "cannot create an event descriptor for halts"));
  event_ = UniqueFd(fd);
  board_.notify = event_.get();
  program_ = std::move(program);
  for (std::size_t i = 0; i < program_.tasks->size(); ++i)
    tasks_.push_back(std::make_unique<DebugTask>(program_.tasks->task(i), board_));
  told_halts_.resize(tasks_.size());
  // No debugger of a process before has a number of this one.
  last_session_ =
      static_cast<std::uint64_t>(MonotonicClock::now().time_since_epoch() / std::chrono::milliseconds(1));
  return {};
}

void DebugService::seen(std::uint64_t session, TimePoint when) noexcept {
  if (session != 0 && session == session_) seen_ = std::max(seen_, when);
}

Result<std::string> DebugService::obey(std::string_view command, TimePoint now) {
  if (!attached()) {
    return failure(ErrorCode::unsupported,
                   "its application is no debug build: build it with 'plcctl build application --debug'");
  }
  const auto [first, rest] = first_word(command);
  if (first == "attach") {
    if (!rest.empty() && rest != "take")
      return failure(ErrorCode::invalid_argument, "'attach' takes nothing, or 'take'");
    return begin_session(rest == "take", now);
  }
  const auto session = number_in<std::uint64_t>(first);
  if (!session)
    return failure(ErrorCode::invalid_argument,
                   fmt::format("'{}' is no command: 'attach' and 'SESSION COMMAND' are", shown(command)));
  if (session_ == 0 || *session != session_) {
    return failure(ErrorCode::wrong_state,
                   fmt::format("session {} is over: its debugger was silent for {} s, has left, or another "
                               "one took over",
                               *session, kLease / std::chrono::seconds(1)));
  }
  seen_ = now;
  const auto [verb, argument] = first_word(rest);
  auto done = carry_out(verb, argument);
  arm();
  return done;
}

Result<std::string> DebugService::begin_session(bool take, TimePoint now) {
  if (session_ != 0 && now - seen_ < kLease && !take) {
    return failure(ErrorCode::busy,
                   fmt::format("a debugger has session {}; 'plcctl debug --take' ends it", session_));
  }
  if (session_ != 0) end_session("another debugger takes over");
  session_ = ++last_session_;
  seen_ = now;
  log_.clear();
  log_number_ = 0;
  for (const auto& task : tasks_) (void)task->forget_steps();
  arm();
  spdlog::warn("a debugger attaches: session {}", session_);
  return debug_answer(
      {{"session", session_}, {"lease_ms", kLease / std::chrono::milliseconds(1)}, {"remark", remark()}});
}

Result<std::string> DebugService::carry_out(std::string_view verb, std::string_view rest) {
  if (verb == "break") return add_breakpoint(rest);
  if (verb == "delete") return remove_breakpoints(rest);
  if (verb == "pause") return pause(rest);
  if (verb == "continue" || verb == "step" || verb == "next" || verb == "out" || verb == "until")
    return go_on(verb, rest);
  if (verb == "local") return write_local(rest);
  if (verb == "halts") {
    if (rest != "all" && rest != "one")
      return failure(ErrorCode::invalid_argument,
                     fmt::format("'{}' cannot be halted by a breakpoint: 'all' and 'one' can", shown(rest)));
    halt_all_ = rest == "all";
    return std::string("{}");
  }
  if (verb == "detach" && rest.empty()) {
    end_session("the debugger leaves");
    return std::string("{}");
  }
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("'{}' is no command. Of breakpoints there are break PLACE [hits COUNT] [if CONDITION] [log "
                  "TEXT], delete ID|*, halts all|one and detach. Of tasks there are continue TASK|*, step "
                  "TASK, next TASK, out TASK, until TASK PLACE, pause TASK|* and local TASK FRAME "
                  "NAME=VALUE",
                  shown(verb)));
}

std::string DebugService::remark() const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    if (tasks_[i]->ignored()) names.push_back(name_of(i));
  }
  if (names.empty()) return {};
  return fmt::format("breakpoints are ignored in tasks of external events under {}: {}", scheduler_,
                     join_some(names));
}

void DebugService::arm() noexcept {
  const bool armed = session_ != 0 && !suspended_;
  __atomic_store_n(&plc_debug_armed, armed ? 1U : 0U, __ATOMIC_SEQ_CST);
}

Result<std::vector<std::size_t>> DebugService::tasks_named(std::string_view name) const {
  std::vector<std::size_t> found;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    names.push_back(name_of(i));
    if (name == "*" || name == names.back()) found.push_back(i);
  }
  if (!found.empty()) return found;
  return failure(ErrorCode::not_found,
                 fmt::format("no task '{}'; there are: {}", shown(name), join_some(names)));
}

Result<StepRule> DebugService::rule_of(std::string_view verb, std::string_view place,
                                       const DebugTask::Halt& halt) const {
  StepRule rule = StepRule::over(*halt.frame, halt.marker, halt.cycle);
  if (verb == "continue") rule.kind = StepRule::Kind::none;
  if (verb == "step") rule.kind = StepRule::Kind::into;
  if (verb == "out") rule.leaves(*halt.frame);
  if (verb == "until") {
    PLCHOST_TRY_ASSIGN(const auto line, program_.pous().find(without_quotes(place)));
    rule.kind = StepRule::Kind::until;
    rule.pou = line.pou;
    rule.line = line.line;
  }
  return rule;
}

Result<std::string> DebugService::go_on(std::string_view verb, std::string_view rest) {
  const auto [name, place] = verb == "until" ? first_word(rest) : std::pair(rest, std::string_view());
  PLCHOST_TRY_ASSIGN(const auto named, tasks_named(name));
  std::vector<std::pair<std::size_t, StepRule>> halted;
  std::size_t forgotten = 0;
  for (const std::size_t task : named) {
    const auto halt = tasks_[task]->halt();
    if (!halt) {
      if (verb == "continue" && tasks_[task]->forget_steps()) ++forgotten;
      continue;
    }
    PLCHOST_TRY_ASSIGN(const auto rule, rule_of(verb, place, *halt));
    halted.emplace_back(task, rule);
  }
  if (halted.empty() && forgotten == 0 && (name != "*" || verb != "continue"))
    return failure(ErrorCode::wrong_state, fmt::format("task '{}' does not halt", shown(name)));
  let_go(halted);
  return nlohmann::json{{"released", halted.size()}}.dump();
}

// Outputs are armed before a task can publish them.
void DebugService::let_go(std::span<const std::pair<std::size_t, StepRule>> tasks) {
  if (tasks.empty()) return;
  for (const auto& [task, rule] : tasks) tasks_[task]->let_go(rule);
  program_.before_go();
  for (const auto& [task, rule] : tasks) tasks_[task]->rouse();
}

void DebugService::let_all_go() {
  std::vector<std::pair<std::size_t, StepRule>> halted;
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    if (halts(i)) halted.emplace_back(i, StepRule{});
  }
  let_go(halted);
}

Result<std::string> DebugService::pause(std::string_view task) {
  PLCHOST_TRY_ASSIGN(const auto named, tasks_named(task));
  std::size_t count = 0;
  for (const std::size_t each : named) {
    if (tasks_[each]->halt() || tasks_[each]->ignored()) continue;
    tasks_[each]->pause();
    ++count;
  }
  return debug_answer({{"paused", count}, {"remark", remark()}});
}

std::size_t DebugService::halted() const noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(tasks_, [](const auto& task) { return task->halt().has_value(); }));
}

void DebugService::end_session(std::string_view why) {
  const std::size_t count = halted();
  spdlog::warn("debug session {} ends: {}; {} gone, {} on", session_, why,
               count_text(breakpoints_.size(), "breakpoint is", "breakpoints are"),
               count_text(count, "halted task goes", "halted tasks go"));
  publish({});
  session_ = 0;
  halt_all_ = false;
  for (const auto& task : tasks_) (void)task->forget_steps();
  let_all_go();
  arm();
}

std::size_t DebugService::suspend(std::string_view why) {
  if (suspended_) return 0;
  const std::size_t count = halted();
  suspended_ = true;
  arm();
  board_.suspended.store(true, std::memory_order_seq_cst);
  for (const auto& task : tasks_) {
    (void)task->forget_steps();
    task->rouse();
  }
  if (count > 0) spdlog::warn("{} on: {}", count_text(count, "halted task goes", "halted tasks go"), why);
  return count;
}

void DebugService::resume(std::string_view scheduler) {
  if (!attached()) return;
  scheduler_ = scheduler;
  const auto known = find_scheduler(scheduler);
  const bool external_halts = known && (*known)->halts_external_tasks;
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    const bool external = traits_of(program_.tasks->task(i).config().kind).names_event;
    tasks_[i]->ignore(external && !external_halts);
  }
  // Their places may be other ones in another version of the application.
  Breakpoints found;
  for (const auto& breakpoint : breakpoints_) {
    auto again = resolve(breakpoint->id, breakpoint->order);
    if (again) {
      again->hits = breakpoint->hits;
      found.push_back(std::make_shared<const Breakpoint>(*std::move(again)));
    } else {
      spdlog::warn("breakpoint {} at {} is gone: {}", breakpoint->id, breakpoint->order.place,
                   again.error().describe());
    }
  }
  publish(std::move(found));
  suspended_ = false;
  board_.suspended.store(false, std::memory_order_seq_cst);
  arm();
}

void DebugService::advance(TimePoint now) {
  if (!attached()) return;
  std::uint64_t told = 0;
  (void)!::read(event_.get(), &told, sizeof told);
  collect();
  take_logs();
  bool fresh = false;
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    const auto halt = tasks_[i]->halt();
    if (halt && std::exchange(told_halts_[i], halt->number) != halt->number) fresh = true;
  }
  // A task that was about to halt when the session ended.
  if (session_ == 0) let_all_go();
  if (fresh && halt_all_ && session_ != 0) {
    for (const auto& task : tasks_) {
      if (!task->halt() && !task->ignored()) task->pause();
    }
  }
  if (session_ != 0 && now - seen_ >= kLease) {
    end_session(fmt::format("its debugger was silent for {} s", kLease / std::chrono::seconds(1)));
  }
}

}  // namespace plchost
