// Writing local variables of the calls of halted tasks: see DebugService.

#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "instances/runtime/debug/debug_service.hpp"
#include "instances/runtime/debug/debug_words.hpp"
#include "shm/base/names.hpp"
#include "shm/base/trimmed.hpp"

namespace plchost {

namespace {

struct LocalOrder {
  std::string_view task;
  std::string_view frame;
  std::string_view name;
  std::string_view value;

  [[nodiscard]] static Result<LocalOrder> parse(std::string_view text) {
    const auto [task, behind_task] = first_word(text);
    const auto [frame, assignment] = first_word(behind_task);
    const std::size_t equal = assignment.find('=');
    if (equal == std::string_view::npos) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("'{}' is not TASK FRAME NAME=VALUE", shown(text)));
    }
    return LocalOrder{.task = task,
                      .frame = frame,
                      .name = trimmed(assignment.substr(0, equal)),
                      .value = trimmed(assignment.substr(equal + 1))};
  }
};

}  // namespace

Result<const Plc_Frame*> DebugService::frame_of(std::string_view task, std::string_view number) const {
  PLCHOST_TRY_ASSIGN(const auto named, tasks_named(task));
  const auto halt = named.size() == 1 ? tasks_[named.front()]->halt() : std::nullopt;
  if (!halt) return failure(ErrorCode::wrong_state, fmt::format("task '{}' does not halt", shown(task)));
  const auto wanted = number_in<std::uint32_t>(number);
  const Plc_Frame* frame = halt->frame;
  for (std::uint32_t i = 0; wanted && frame != nullptr && i < *wanted; ++i) frame = frame->pCaller;
  const bool is_known = wanted && frame != nullptr && frame->pPou != nullptr &&
                        frame->pPou->dwNumber < program_.pous().pous().size();
  if (is_known) return frame;
  return failure(ErrorCode::not_found, fmt::format("no frame '{}' in task '{}': the frames have 0 to {}",
                                                   shown(number), shown(task), halt->frame->dwDepth));
}

Result<std::string> DebugService::write_local(std::string_view order) {
  PLCHOST_TRY_ASSIGN(const auto parts, LocalOrder::parse(order));
  PLCHOST_TRY_ASSIGN(const auto* const frame, frame_of(parts.task, parts.frame));
  const DeclaredPou& pou = program_.pous().pous()[frame->pPou->dwNumber];
  PLCHOST_TRY_ASSIGN(const auto found, pou.local(parts.name, *frame));
  if (!found) {
    return failure(ErrorCode::not_found, fmt::format("no local variable '{}' at {}:{}", shown(parts.name),
                                                     pou.name, frame->dwLine));
  }
  const VariableSymbol& symbol = pou.locals[found->local].symbol;
  // Its thread sleeps.
  auto written = parse_variable(symbol.type, parts.value,
                                std::span(local_address(*frame, found->local) + found->offset, symbol.bytes));
  if (!written)
    return failure_in(fmt::format("local variable '{}'", shown(parts.name)), std::move(written).error());
  return nlohmann::json{{"written", symbol.name}}.dump();
}

}  // namespace plchost
