// The state of a debug session as its debugger sees it: DebugService::state().

#include <algorithm>
#include <array>
#include <utility>

#include <nlohmann/json.hpp>

#include "instances/runtime/debug/debug_service.hpp"
#include "instances/runtime/debug/told_locals.hpp"

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

// In steps: else the state would be another one at each look, and be written and read anew.
Duration time_of(const DebugTask::Halt& halt) {
  constexpr auto kStep = std::chrono::milliseconds(100);
  return (MonotonicClock::now() - halt.since) / kStep * kStep;
}

// The frames are on the stack of a thread that sleeps.
Json frames_of(const Plc_Frame* frame, const PouCollection& pous, DebugService::StackDetail detail,
               TextBudget& budget) {
  Json frames = Json::array();
  for (; frame != nullptr && frames.size() < detail.frames && !budget.is_spent(); frame = frame->pCaller) {
    if (frame->pPou == nullptr || frame->pPou->dwNumber >= pous.pous().size()) break;
    const DeclaredPou& pou = pous.pous()[frame->pPou->dwNumber];
    Json one{{"pou", pou.name}, {"file", pou.file}, {"line", frame->dwLine}};
    const auto path = pous.path_of(frame->pPou->dwNumber, frame->pSelf);
    if (!path.empty()) one["instance"] = path;
    if (frame->nLocals > 0 && frames.size() < detail.with_locals) {
      one["locals"] = told_locals(*frame, pou, detail.elements, budget);
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
  DebugService::StackDetail stack;
  bool texts;  ///< lines of log points, and what was written behind the places of breakpoints
  bool breakpoints;
  const char* left_out;
};
constexpr std::size_t kFrames = DebugService::kMostFrames;
constexpr std::size_t kFewElements = 16;
// An array never takes the place of a variable that is none.
constexpr std::array kDetails{
    Detail{{kFrames, kFrames, DebugService::kMostElements}, true, true, ""},
    Detail{{kFrames, kFrames, kFewElements}, true, true, "elements of local arrays"},
    Detail{{kFrames, kFrames, 0}, true, true, "all elements of local arrays"},
    Detail{
        {kFrames, 1, kFewElements}, true, true, "local variables of callers, and elements of local arrays"},
    Detail{{kFrames, 1, 0}, true, true, "local variables of callers, and all elements of local arrays"},
    Detail{{kFrames, 0, 0}, true, true, "local variables"},
    Detail{{4, 0, 0}, true, true, "local variables"},
    Detail{{4, 0, 0},
           false,
           true,
           "local variables, conditions and texts of breakpoints, and lines of log points"},
    Detail{{1, 0, 0}, false, false, "local variables, all breakpoints, and lines of log points"}};

}  // namespace

std::string_view DebugService::state_text(const DebugTask& task, bool halted) const noexcept {
  if (suspended_) return "stopped";
  if (halted) return "halted";
  if (task.is_to_pause() || task.steps()) return "steps";
  return task.ignored() ? "ignored" : "runs";
}

nlohmann::json DebugService::state_of_task(std::size_t number, StackDetail detail, TextBudget& budget) const {
  const DebugTask& task = *tasks_[number];
  const auto halt = task.halt();  // once: it may halt meanwhile, and a state has its place and stack
  Json one{{"task", name_of(number)}, {"state", state_text(task, halt.has_value())}};
  if (task.halts() > 0) {
    one["halts"] = task.halts();
    const Duration going_on = halt ? time_of(*halt) : Duration();
    one["halted_ms"] = (task.halted_for() + going_on) / std::chrono::milliseconds(1);
    // The task itself counts these later.
    const std::uint64_t passing = halt ? task.task().releases_passing(halt->before + going_on) : 0;
    one["releases_halted"] = task.task().releases_passed() + passing;
  }
  if (!halt) return one;
  one["halt"] = halt->number;
  one["reason"] = reason_text(halt->reason);
  if (halt->breakpoint != 0) one["breakpoint"] = halt->breakpoint;
  one["stack"] = frames_of(halt->frame, program_.pous(), detail, budget);
  return one;
}

std::string DebugService::state(std::size_t most) const {
  const auto dump = [](const Json& json) { return json.dump(-1, ' ', true, Json::error_handler_t::replace); };
  for (const Detail& detail : kDetails) {
    TextBudget budget(most);
    Json tasks = Json::array();
    for (std::size_t i = 0; i < tasks_.size() && !budget.is_spent(); ++i)
      tasks.push_back(state_of_task(i, detail.stack, budget));
    if (budget.is_spent()) continue;
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
