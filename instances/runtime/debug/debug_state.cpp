// The state of a debug session as its debugger sees it: DebugService::state().

#include <array>
#include <utility>

#include <nlohmann/json.hpp>

#include "instances/runtime/debug/debug_service.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

std::string_view reason_text(HaltReason reason) noexcept {
  switch (reason) {
    case HaltReason::breakpoint:
      return "breakpoint";
    case HaltReason::step:
      return "step";
    case HaltReason::pause:
      return "pause";
  }
  return "";
}

// Those of its statement that this call has.
Json locals_of(const Plc_Frame& frame, const DeclaredPou& pou) {
  Json locals = Json::array();
  for (std::uint32_t i = 0; i < pou.locals.size(); ++i) {
    const DeclaredLocal& local = pou.locals[i];
    const std::byte* const address = local_address(frame, i);
    if (address == nullptr || !local.is_at(frame.dwLine)) continue;
    const std::span bytes(address, local.bytes);
    locals.push_back({{"name", local.name},
                      {"type", traits_of(local.type).name},
                      {"value", variable_text(local.type, bytes)}});
  }
  return locals;
}

// In steps: else the state would be another one at each look, and be written and read anew.
Duration time_of(const DebugTask::Halt& halt) {
  constexpr auto kStep = std::chrono::milliseconds(100);
  return (MonotonicClock::now() - halt.since) / kStep * kStep;
}

/// How much of a stack is told.
struct StackDetail {
  std::size_t frames = 0;
  std::size_t with_locals = 0;  ///< the innermost, of those
};

// The frames are on the stack of a thread that sleeps.
Json frames_of(const Plc_Frame* frame, const PouCollection& pous, StackDetail detail) {
  Json frames = Json::array();
  for (; frame != nullptr && frames.size() < detail.frames; frame = frame->pCaller) {
    if (frame->pPou == nullptr || frame->pPou->dwNumber >= pous.pous().size()) break;
    const DeclaredPou& pou = pous.pous()[frame->pPou->dwNumber];
    Json one{{"pou", pou.name}, {"file", pou.file}, {"line", frame->dwLine}};
    const auto path = pous.path_of(frame->pPou->dwNumber, frame->pSelf);
    if (!path.empty()) one["instance"] = path;
    if (frame->nLocals > 0 && frames.size() < detail.with_locals) {
      one["locals"] = locals_of(*frame, pou);
    } else if (frame->nLocals > 0) {
      one["locals_left_out"] = true;
    }
    frames.push_back(std::move(one));
  }
  return frames;
}

// `orders`: with what was written behind the place.
Json json_of(const Breakpoint& breakpoint, const PouCollection& pous, bool orders) {
  const DeclaredPou& pou = pous.pous()[breakpoint.place.pou];
  Json one{{"id", breakpoint.id},
           {"pou", pou.name},
           {"file", pou.file},
           {"line", breakpoint.place.line},
           {"hits", breakpoint.hits->load(std::memory_order_relaxed)}};
  if (!orders) return one;
  if (!breakpoint.order.condition.empty()) one["condition"] = breakpoint.order.condition;
  if (!breakpoint.order.hits.empty()) one["hit_rule"] = breakpoint.order.hits;
  if (!breakpoint.order.log.empty()) one["log"] = breakpoint.order.log;
  return one;
}

/// The parts of a state that is too long otherwise. Halts are told in each.
struct Detail {
  StackDetail stack;
  bool texts;  ///< lines of log points, and what was written behind the places of breakpoints
  bool breakpoints;
  const char* left_out;
};
constexpr std::array kDetails{
    Detail{{DebugService::kMostFrames, DebugService::kMostFrames}, true, true, ""},
    Detail{{DebugService::kMostFrames, 1}, true, true, "local variables of callers"},
    Detail{{DebugService::kMostFrames, 0}, true, true, "local variables"},
    Detail{{4, 0}, true, true, "local variables"},
    Detail{
        {4, 0}, false, true, "local variables, conditions and texts of breakpoints, and lines of log points"},
    Detail{{1, 0}, false, false, "local variables, all breakpoints, and lines of log points"}};

}  // namespace

std::string_view DebugService::state_text(const DebugTask& task, bool halted) const noexcept {
  if (suspended_) return "stopped";
  if (halted) return "halted";
  if (task.is_to_pause() || task.steps()) return "steps";
  return task.ignored() ? "ignored" : "runs";
}

nlohmann::json DebugService::state_of_task(std::size_t number, std::size_t frames,
                                           std::size_t with_locals) const {
  const DebugTask& task = *tasks_[number];
  const auto halt = task.halt();  // once: it may halt meanwhile, and a state has its place and stack
  Json one{{"task", name_of(number)}, {"state", state_text(task, halt.has_value())}};
  if (task.halts() > 0) {
    one["halts"] = task.halts();
    const Duration going_on = halt ? time_of(*halt) : Duration();
    one["halted_ms"] = (task.halted_for() + going_on) / std::chrono::milliseconds(1);
    // The task itself counts the releases at the end of the cycle.
    const Duration interval = halt ? task.task().interval_in_force() : Duration();
    const std::uint64_t passed =
        interval > Duration() ? static_cast<std::uint64_t>((halt->before + going_on) / interval) : 0;
    one["releases_halted"] = task.task().releases_passed() + passed;
  }
  if (!halt) return one;
  one["halt"] = halt->number;
  one["reason"] = reason_text(halt->reason);
  if (halt->breakpoint != 0) one["breakpoint"] = halt->breakpoint;
  one["stack"] = frames_of(halt->frame, program_.pous(), {.frames = frames, .with_locals = with_locals});
  return one;
}

std::string DebugService::state(std::size_t most) const {
  const auto dump = [](const Json& json) { return json.dump(-1, ' ', true, Json::error_handler_t::replace); };
  for (const Detail& detail : kDetails) {
    Json tasks = Json::array();
    for (std::size_t i = 0; i < tasks_.size(); ++i)
      tasks.push_back(state_of_task(i, detail.stack.frames, detail.stack.with_locals));
    Json breakpoints = Json::array();
    for (const auto& breakpoint : breakpoints_) {
      if (detail.breakpoints) breakpoints.push_back(json_of(*breakpoint, program_.pous(), detail.texts));
    }
    Json log = Json::array();
    for (const LogLine& line : log_) {
      if (detail.texts) log.push_back({{"number", line.number}, {"text", line.text}});
    }
    Json all{{"session", session_},        {"halt_all", halt_all_}, {"suspended", suspended_},
             {"tasks", std::move(tasks)},  {"log", std::move(log)}, {"logged", log_number_},
             {"left_out", detail.left_out}};
    if (detail.breakpoints) all["breakpoints"] = std::move(breakpoints);
    std::string text = dump(all);
    if (text.size() <= most) return text;
  }
  return dump({{"session", session_}, {"too_long", true}});
}

}  // namespace plchost
