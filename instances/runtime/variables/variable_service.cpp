#include "instances/runtime/variables/variable_service.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/variables/order_text.hpp"

namespace plchost {

namespace {

Result<std::pair<std::string_view, std::string_view>> split_order(std::string_view argument) {
  const std::size_t equal = argument.find('=');
  if (equal == std::string_view::npos || equal == 0) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("'{}' is not allowed: NAME=VALUE is, as Main.speed=5", shown(argument)));
  }
  return std::pair(argument.substr(0, equal), argument.substr(equal + 1));
}

}  // namespace

void VariableService::place(std::vector<DeclaredVariable> variables, std::vector<std::string> tasks) {
  access_ = VariableAccess(std::move(variables));
  tasks_ = std::move(tasks);
  lists_.resize(tasks_.size());
  slots_.resize(tasks_.size());
}

VariableService::Next VariableService::prepare(std::vector<DeclaredVariable> variables) const {
  Next next{.access = VariableAccess(std::move(variables)), .forces = {}, .lists = {}, .ended = {}};
  next.forces = forces_.carried(access_, next.access, next.ended);
  next.lists = next.forces.lists(next.access, tasks_);
  return next;
}

void VariableService::use(std::vector<ForceList>& lists) noexcept {
  std::swap(lists_, lists);
  for (std::size_t task = 0; task < slots_.size(); ++task)
    slots_[task].list = lists_[task].empty() ? nullptr : &lists_[task];
}

void VariableService::take_over(Next& next) noexcept {
  std::swap(access_, next.access);
  std::swap(forces_, next.forces);
  use(next.lists);
}

Result<void> VariableService::publish(const std::string& pool, const std::string& instance) {
  const auto none = [&] {
    page_.reset();
    SymbolPage::remove(pool, instance);
  };
  if (count() == 0) {
    none();
    return {};
  }
  auto page = SymbolPage::create(pool, instance, access_.symbols());
  if (page) {
    page_.emplace(*std::move(page));
    return {};
  }
  none();
  return failure_in("table of variables", std::move(page).error());
}

std::string VariableService::forced_names() const {
  std::vector<std::string> names;
  forces_.for_each([&](VariableElement element, const auto&) { names.push_back(access_.name(element)); });
  return join_some(names);
}

Result<SamplePlan> VariableService::plan(const ValueRequest& request) const {
  if (!page_ || request.stream != stream())
    return failure(ErrorCode::wrong_state, "the table is another one by now");
  SamplePlan plan;
  if (request.kind == ValueKind::forced) return plan;
  plan.sources.reserve(request.elements.size());
  for (const VariableElement element : request.elements) {
    if (!access_.has(element)) return failure(ErrorCode::not_found, "the table has no such element");
    plan.sources.emplace_back(access_.bytes(element));
    plan.bytes += plan.sources.back().size();
  }
  if (plan.bytes > kMaxValueBytes)
    return failure(ErrorCode::full,
                   fmt::format("{} bytes of values; at most {}", plan.bytes, kMaxValueBytes));
  return plan;
}

void VariableService::copy(const SamplePlan& plan, std::span<std::byte> values) noexcept {
  for (const auto source : plan.sources) {
    std::memcpy(values.data(), source.data(), source.size());
    values = values.subspan(source.size());
  }
}

ValueReply VariableService::forced_values() const {
  ValueReply reply;
  reply.consistent = true;
  forces_.for_each([&](VariableElement element, const Forces::Value& value) {
    reply.elements.push_back(element);
    reply.values.insert(reply.values.end(), value.begin(), value.end());
  });
  reply.forced.assign(reply.elements.size(), 1);
  return reply;
}

std::vector<std::uint8_t> VariableService::marks(std::span<const VariableElement> elements) const {
  std::vector<std::uint8_t> marks;
  marks.reserve(elements.size());
  for (const VariableElement element : elements) marks.push_back(forces_.find(element) != nullptr ? 1 : 0);
  return marks;
}

Result<VariableElement> VariableService::writable(std::string_view name) const {
  PLCHOST_TRY_ASSIGN(const auto element, access_.find(name));
  if (!access_.symbol(element).read_only) return element;
  return failure(ErrorCode::refused,
                 fmt::format("'{}': the application has declared it as read-only", access_.name(element)));
}

Result<VariableOrder> VariableService::order(VariableOrder::Kind kind, std::string_view argument) const {
  VariableOrder order{
      .kind = kind, .elements = {}, .value = {}, .before = {}, .forces = forces_, .lists = {}};
  if (kind == VariableOrder::Kind::unforce && argument == "*") {
    forces_.for_each([&](VariableElement element, const auto&) { order.elements.push_back(element); });
    order.forces.clear();
  } else if (kind == VariableOrder::Kind::unforce) {
    PLCHOST_TRY_ASSIGN(const auto element, access_.find(argument));
    order.elements.push_back(element);
    if (!order.forces.erase(element))
      return failure(ErrorCode::wrong_state, fmt::format("'{}' is not forced", access_.name(element)));
  } else {
    PLCHOST_TRY_ASSIGN(const auto parts, split_order(argument));
    PLCHOST_TRY_ASSIGN(const auto element, writable(parts.first));
    const VariableSymbol& symbol = access_.symbol(element);
    order.elements.push_back(element);
    order.value.resize(symbol.bytes);
    order.before.resize(symbol.bytes);
    if (auto parsed = parse_variable(symbol.type, parts.second, order.value); !parsed)
      return failure_in(access_.name(element), std::move(parsed).error());
    if (kind == VariableOrder::Kind::force) PLCHOST_TRY(order.forces.set(element, order.value));
  }
  if (kind != VariableOrder::Kind::write) order.lists = order.forces.lists(access_, tasks_);
  return order;
}

void VariableService::make(VariableOrder& order) noexcept {
  if (!order.value.empty()) {
    const auto bytes = access_.bytes(order.elements.front());
    std::memcpy(order.before.data(), bytes.data(), bytes.size());
    // A force holds from now on, also if no task begins a cycle soon.
    store_value(bytes.data(), order.value);
  }
  if (order.kind == VariableOrder::Kind::write) return;
  std::swap(forces_, order.forces);
  use(order.lists);
}

std::string VariableService::describe(const VariableOrder& order) const {
  if (order.kind == VariableOrder::Kind::unforce) {
    std::vector<std::string> names;
    for (const VariableElement element : order.elements) names.push_back(access_.name(element));
    return names.empty() ? "no variable was forced" : fmt::format("forces end: {}", join_some(names));
  }
  const VariableElement element = order.elements.front();
  const bool forces = order.kind == VariableOrder::Kind::force;
  std::string text = order_text(access_.name(element), forces, access_.text(element, order.before),
                                access_.text(element, order.value));
  if (const auto* const forced = forces_.find(element); forced != nullptr && !forces) {
    text += fmt::format("; it is forced to {}, which overrides it in the next cycle",
                        access_.text(element, *forced));
  }
  return text;
}

}  // namespace plchost
