// The breakpoints of a debug session, and the lines of its log points: see DebugService.

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "instances/runtime/debug/debug_answer.hpp"
#include "instances/runtime/debug/debug_service.hpp"
#include "instances/runtime/debug/debug_words.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// Beyond that a variable of a POU lies elsewhere than its instance.
constexpr std::ptrdiff_t kMaxInstanceBytes = 16 << 20;

// A variable of all instances, which are at `selves`: it lies at `addresses`. Nothing: not in the same place
// of each, nor in one for all.
std::optional<ValuePlace> place_in_each(ValuePlace place, std::span<const std::byte* const> selves,
                                        std::span<const std::byte* const> addresses) {
  place.address = addresses.front();
  const auto is_first = [&](const auto* one) { return one == addresses.front(); };
  if (addresses.size() > 1 && std::ranges::all_of(addresses, is_first)) return place;
  place.offset = addresses.front() - selves.front();
  const bool is_within = place.offset >= 0 && place.offset < kMaxInstanceBytes;
  if (is_within) place.base = ValuePlace::Base::self;
  for (std::size_t i = 1; i < addresses.size(); ++i) {
    if (!is_within || addresses[i] - selves[i] != place.offset) return std::nullopt;
  }
  return place;
}

}  // namespace

ValuePlace DebugService::place_of(VariableElement element) const {
  const VariableAccess& variables = program_.variables();
  const VariableSymbol& symbol = variables.symbol(element);
  return {.type = symbol.type, .bytes = symbol.bytes, .address = variables.bytes(element).data()};
}

Result<std::optional<ValuePlace>> DebugService::find_local_value(PouLine place, std::string_view name) const {
  const DeclaredPou& pou = program_.pous().pous()[place.pou];
  PLCHOST_TRY_ASSIGN(const auto found, pou.local(name, place.line));
  if (!found) return std::nullopt;
  const VariableSymbol& symbol = pou.locals[found->local].symbol;
  return ValuePlace{.type = symbol.type,
                    .bytes = symbol.bytes,
                    .base = ValuePlace::Base::local,
                    .offset = found->offset,
                    .local = found->local};
}

Result<std::optional<ValuePlace>> DebugService::find_own_value(std::uint32_t pou,
                                                               std::string_view name) const {
  std::optional<ValuePlace> own;
  std::vector<const std::byte*> selves;
  std::vector<const std::byte*> addresses;
  const auto instances = program_.pous().instances_of(pou);
  for (const auto& instance : instances) {
    const auto found = program_.variables().find(fmt::format("{}.{}", instance.path, name));
    // Such as an index out of the range of an own array.
    if (!found && found.error().code != ErrorCode::not_found) return std::unexpected(found.error());
    if (!found) continue;
    own = place_of(*found);
    selves.push_back(static_cast<const std::byte*>(instance.self));
    addresses.push_back(own->address);
  }
  if (!own) return std::nullopt;
  if (addresses.size() == instances.size()) {
    if (const auto place = place_in_each(*own, selves, addresses)) return place;
  }
  return failure(
      ErrorCode::unsupported,
      fmt::format("'{}' of {} lies apart from its instances: name that of one of them, as '{}.{}'",
                  shown(name), program_.pous().pous()[pou].name, instances.front().path, shown(name)));
}

Result<Breakpoint> DebugService::resolve(std::uint32_t id, BreakpointOrder order) const {
  Breakpoint breakpoint{.id = id,
                        .place = {},
                        .order = std::move(order),
                        .hit_rule = {},
                        .condition = {},
                        .log = {},
                        .elsewhere = {},
                        .hits = std::make_shared<std::atomic<std::uint64_t>>(0)};
  PLCHOST_TRY_ASSIGN(breakpoint.place, program_.pous().find(breakpoint.order.place));
  const FindValue find = [&](std::string_view name) -> Result<ValuePlace> {
    PLCHOST_TRY_ASSIGN(const auto local, find_local_value(breakpoint.place, name));
    if (local) return *local;
    PLCHOST_TRY_ASSIGN(const auto own, find_own_value(breakpoint.place.pou, name));
    if (own) return *own;
    PLCHOST_TRY_ASSIGN(const auto element, program_.variables().find(name));
    if (name.find('.') == std::string_view::npos) breakpoint.elsewhere.emplace_back(name);
    return place_of(element);
  };
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
  auto answer = debug_answer({{"id", breakpoint.id},
                              {"pou", pou.name},
                              {"file", pou.file},
                              {"line", breakpoint.place.line},
                              {"remark", remark_of(breakpoint)}});
  Breakpoints more = breakpoints_;
  more.push_back(std::make_shared<const Breakpoint>(std::move(breakpoint)));
  publish(std::move(more));
  return answer;
}

std::string DebugService::remark_of(const Breakpoint& breakpoint) const {
  std::string text = remark();
  if (breakpoint.elsewhere.empty()) return text;
  if (!text.empty()) text += "; ";
  return text + fmt::format("no variables of {}, but of the application: {}",
                            program_.pous().pous()[breakpoint.place.pou].name,
                            join_some(breakpoint.elsewhere));
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

void DebugService::take_logs() {
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    tasks_[i]->take_logs([&](const LogHit& hit) { write_log(hit, name_of(i)); });
    const auto lost = tasks_[i]->take_lost_logs();
    log_number_ += lost;  // the debugger sees that they are missing
    if (lost > 0) spdlog::warn("task '{}': {} more hits of log points were not written", name_of(i), lost);
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
