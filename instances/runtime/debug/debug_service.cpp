#include "instances/runtime/debug/debug_service.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/eventfd.h>
#include <unistd.h>

#include "schedulers/policies/registry.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// Beyond that the variables of a POU lie elsewhere than its instance: they are shared.
constexpr std::ptrdiff_t kMaxInstanceBytes = 16 << 20;

std::pair<std::string_view, std::string_view> first_word(std::string_view text) noexcept {
  const std::size_t space = text.find(' ');
  if (space == std::string_view::npos) return {text, {}};
  return {text.substr(0, space), text.substr(space + 1)};
}

template <class Number>
std::optional<Number> number_in(std::string_view text) noexcept {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

Result<void> DebugService::attach(Program program) {
  PLCHOST_TRY_ASSIGN(const int fd, check_errno(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK),
                                               "cannot create an event descriptor for halts"));
  event_ = UniqueFd(fd);
  board_.notify = event_.get();
  program_ = std::move(program);
  for (std::size_t i = 0; i < program_.tasks->size(); ++i)
    tasks_.push_back(std::make_unique<DebugTask>(program_.tasks->task(i), board_));
  told_halts_.resize(tasks_.size());
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
                   fmt::format("a debugger has session {}; 'attach take' ends it", session_));
  }
  if (session_ != 0) end_session("another debugger takes over");
  session_ = ++last_session_;
  seen_ = now;
  halt_all_ = false;
  arm();
  spdlog::warn("a debugger attaches: session {}", session_);
  return nlohmann::json{
      {"session", session_}, {"lease_ms", kLease / std::chrono::milliseconds(1)}, {"remark", remark()}}
      .dump();
}

Result<std::string> DebugService::carry_out(std::string_view verb, std::string_view rest) {
  if (verb == "break") return add_breakpoint(rest);
  if (verb == "delete") return remove_breakpoints(rest);
  if (verb == "pause") return pause(rest);
  if (verb == "continue" || verb == "step" || verb == "next" || verb == "out" || verb == "until")
    return go_on(verb, rest);
  if (verb == "halts" && (rest == "all" || rest == "one")) {
    halt_all_ = rest == "all";
    return std::string("{}");
  }
  if (verb == "detach" && rest.empty()) {
    end_session("the debugger leaves");
    return std::string("{}");
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is no command: break PLACE [hits COUNT] [if CONDITION] [log TEXT], delete "
                             "ID|*, continue TASK|*, step TASK, next TASK, out TASK, until TASK PLACE, pause "
                             "TASK|*, halts all|one and detach are",
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

Result<ValuePlace> DebugService::find_value(std::uint32_t pou, std::string_view name) const {
  const VariableAccess& variables = program_.variables();
  const auto place_of = [&](VariableElement element) {
    const VariableSymbol& symbol = variables.symbol(element);
    return ValuePlace{.type = symbol.type, .bytes = symbol.bytes, .address = variables.bytes(element).data()};
  };
  if (const auto instance = program_.pous().any_instance(pou)) {
    if (const auto own = variables.find(fmt::format("{}.{}", instance->path, name))) {
      ValuePlace place = place_of(*own);
      place.offset = place.address - static_cast<const std::byte*>(instance->self);
      place.of_self = place.offset >= 0 && place.offset < kMaxInstanceBytes;
      return place;
    }
  }
  PLCHOST_TRY_ASSIGN(const auto element, variables.find(name));
  return place_of(element);
}

Result<Breakpoint> DebugService::resolve(std::uint32_t id, BreakpointOrder order) const {
  Breakpoint breakpoint{.id = id,
                        .place = {},
                        .order = std::move(order),
                        .hit_rule = {},
                        .condition = {},
                        .log = {},
                        .hits = std::make_shared<std::atomic<std::uint64_t>>(0)};
  PLCHOST_TRY_ASSIGN(breakpoint.place, program_.pous().find(breakpoint.order.place));
  const FindValue find = [&](std::string_view name) { return find_value(breakpoint.place.pou, name); };
  if (!breakpoint.order.hits.empty()) {
    PLCHOST_TRY_ASSIGN(breakpoint.hit_rule, HitRule::parse(breakpoint.order.hits));
  }
  if (!breakpoint.order.condition.empty()) {
    PLCHOST_TRY_ASSIGN(breakpoint.condition, Condition::parse(breakpoint.order.condition, find));
  }
  if (!breakpoint.order.log.empty()) {
    PLCHOST_TRY_ASSIGN(breakpoint.log, LogTemplate::parse(breakpoint.order.log, find));
  }
  return breakpoint;
}

Result<std::string> DebugService::add_breakpoint(std::string_view text) {
  if (breakpoints_.size() == BreakpointTable::kMost) {
    return failure(ErrorCode::full,
                   fmt::format("there are {} breakpoints already: delete some", BreakpointTable::kMost));
  }
  PLCHOST_TRY_ASSIGN(auto order, BreakpointOrder::parse(text));
  PLCHOST_TRY_ASSIGN(auto breakpoint, resolve(next_id_, std::move(order)));
  ++next_id_;
  const DeclaredPou& pou = program_.pous().pous()[breakpoint.place.pou];
  const nlohmann::json answer{{"id", breakpoint.id},
                              {"pou", pou.name},
                              {"file", pou.file},
                              {"line", breakpoint.place.line},
                              {"remark", remark()}};
  Breakpoints more = breakpoints_;
  more.push_back(std::make_shared<const Breakpoint>(std::move(breakpoint)));
  publish(std::move(more));
  return answer.dump();
}

Result<std::string> DebugService::remove_breakpoints(std::string_view id) {
  Breakpoints left;
  const auto number = number_in<std::uint32_t>(id);
  for (const auto& breakpoint : breakpoints_) {
    if (id != "*" && number != breakpoint->id) left.push_back(breakpoint);
  }
  if (id != "*" && left.size() == breakpoints_.size())
    return failure(ErrorCode::not_found, fmt::format("no breakpoint '{}'", shown(id)));
  const std::size_t removed = breakpoints_.size() - left.size();
  publish(std::move(left));
  return nlohmann::json{{"deleted", removed}}.dump();
}

// The table goes first to the tasks; the one before is freed when none looks at it any more.
void DebugService::publish(Breakpoints breakpoints) {
  take_logs();  // of those that go
  removed_ = std::exchange(breakpoints_, std::move(breakpoints));
  auto table = breakpoints_.empty()
                   ? nullptr
                   : std::make_unique<const BreakpointTable>(breakpoints_, program_.pous().pous().size());
  board_.table.store(table.get(), std::memory_order_seq_cst);
  if (auto before = std::exchange(table_, std::move(table))) retired_.push_back(std::move(before));
  collect();
}

void DebugService::collect() {
  std::erase_if(retired_, [&](const auto& table) {
    return std::ranges::none_of(tasks_, [&](const auto& task) { return task->looks_at(table.get()); });
  });
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
  StepRule rule{.kind = StepRule::Kind::none,
                .cycle = halt.cycle,
                .depth = halt.frame->dwDepth,
                .line = halt.frame->dwLine,
                .pou = halt.frame->pPou->dwNumber};
  if (verb == "step") rule.kind = StepRule::Kind::into;
  if (verb == "next") rule.kind = StepRule::Kind::over;
  if (verb == "out") rule.kind = StepRule::Kind::out;
  if (verb == "until") {
    PLCHOST_TRY_ASSIGN(const auto line, program_.pous().find(place));
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
  for (const std::size_t task : named) {
    const auto halt = tasks_[task]->halt();
    if (verb == "continue") tasks_[task]->forget_pause();
    if (!halt) continue;
    PLCHOST_TRY_ASSIGN(const auto rule, rule_of(verb, place, *halt));
    halted.emplace_back(task, rule);
  }
  if (halted.empty() && (name != "*" || verb != "continue"))
    return failure(ErrorCode::wrong_state, fmt::format("task '{}' does not halt", shown(name)));
  for (const auto& [task, rule] : halted) tasks_[task]->let_go(rule);
  return nlohmann::json{{"released", halted.size()}}.dump();
}

Result<std::string> DebugService::pause(std::string_view task) {
  PLCHOST_TRY_ASSIGN(const auto named, tasks_named(task));
  std::size_t count = 0;
  for (const std::size_t each : named) {
    if (tasks_[each]->halt() || tasks_[each]->ignored()) continue;
    tasks_[each]->pause();
    ++count;
  }
  return nlohmann::json{{"paused", count}, {"remark", remark()}}.dump();
}

std::size_t DebugService::halted() const noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(tasks_, [](const auto& task) { return task->halt().has_value(); }));
}

void DebugService::end_session(std::string_view why) {
  const std::size_t count = halted();
  spdlog::warn("debug session {} ends: {}; {} breakpoints are gone, {} halted tasks go on", session_, why,
               breakpoints_.size(), count);
  publish({});
  session_ = 0;
  for (const auto& task : tasks_) {
    task->forget_pause();
    task->end_step();
    if (task->halt()) task->let_go({});
  }
  arm();
}

std::size_t DebugService::suspend(std::string_view why) {
  if (suspended_) return 0;
  const std::size_t count = halted();
  suspended_ = true;
  arm();
  board_.suspended.store(true, std::memory_order_seq_cst);
  for (const auto& task : tasks_) {
    task->forget_pause();
    task->end_step();
    task->rouse();
  }
  if (count > 0) spdlog::warn("{} halted tasks go on: {}", count, why);
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
  for (const auto& task : tasks_) {
    if (session_ == 0 && task->halt()) task->let_go({});
  }
  if (fresh && halt_all_) {
    for (const auto& task : tasks_) {
      if (!task->halt() && !task->ignored()) task->pause();
    }
  }
  if (session_ != 0 && now - seen_ >= kLease) {
    end_session(fmt::format("its debugger was silent for {} s", kLease / std::chrono::seconds(1)));
  }
}

void DebugService::take_logs() {
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    tasks_[i]->take_logs([&](const LogHit& hit) { write_log(hit, name_of(i)); });
    if (const auto lost = tasks_[i]->take_lost_logs(); lost > 0)
      spdlog::warn("task '{}': {} more hits of log points were not written", name_of(i), lost);
  }
}

void DebugService::write_log(const LogHit& hit, std::string_view task) {
  const auto is_hit = [&](const auto& breakpoint) { return breakpoint->id == hit.breakpoint; };
  auto found = std::ranges::find_if(breakpoints_, is_hit);
  if (found == breakpoints_.end()) {
    found = std::ranges::find_if(removed_, is_hit);
    if (found == removed_.end()) return;
  }
  if (!(*found)->log) return;
  const LogTemplate& log = *(*found)->log;
  std::string text = log.texts.front();
  for (std::size_t i = 0; i < log.values.size(); ++i) {
    const auto bytes = std::span(hit.values.at(i)).first(log.values[i].bytes);
    text += variable_text(log.values[i].type, bytes) + log.texts[i + 1];
  }
  spdlog::info("log point {} in task '{}': {}", hit.breakpoint, task, text);
  log_.push_back({.number = ++log_number_, .text = std::move(text)});
  if (log_.size() > kLogKept) log_.pop_front();
}

}  // namespace plchost
