#include "shm/operations/operations.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/base/stop_limits.hpp"

namespace plchost {

namespace {

using Place = OperationPlace;
using Argument = OperationArgument;
using Right = OperationRight;
using std::chrono::seconds;
constexpr ApiRole kViewer = ApiRole::viewing;
constexpr ApiRole kEngineer = ApiRole::engineering;

/// "reset_cold" as "reset cold".
template <std::size_t Size>
struct Words {
  std::array<char, Size> text{};
  consteval Words(const char (&name)[Size]) {  // NOLINT(*-explicit-*, *-avoid-c-arrays)
    std::ranges::replace_copy(name, text.begin(), '_', ' ');
  }
};
template <Words kText>
constexpr std::string_view kWords{kText.text.data(), kText.text.size() - 1};

constexpr std::array kOperations = {
#define OPERATION(word, number, meaning, ...) \
  Operation{.verb = ControlVerb::word, .name = kWords<#word> __VA_OPT__(, ) __VA_ARGS__},
#include "shm/operations/operations.def"
#undef OPERATION
};

constexpr Operation kNone{.verb = ControlVerb{}, .name = "?", .place = Place::internal};

}  // namespace

std::span<const Operation> operations() noexcept {
  return kOperations;
}

const Operation& operation_of(ControlVerb verb) noexcept {
  const auto* const found = std::ranges::find(kOperations, verb, &Operation::verb);
  return found != kOperations.end() ? *found : kNone;
}

Duration least_wait(const Operation& operation) noexcept {
  return operation.takes_long || operation.limit > kCommandLimit ? kLongCommand : Duration::zero();
}

const Operation* find_operation(std::int32_t number) noexcept {
  const auto* const found = std::ranges::find_if(kOperations, [number](const Operation& operation) {
    return static_cast<std::int32_t>(operation.verb) == number && operation.place != Place::internal;
  });
  return found != kOperations.end() ? found : nullptr;
}

const Operation* find_operation(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kOperations, name, &Operation::name);
  return found != kOperations.end() && found->place != Place::internal ? found : nullptr;
}

std::string_view to_string(ControlVerb verb) noexcept {
  return operation_of(verb).name;
}

std::string ended_forces_text(std::size_t count) {
  return count == 0 ? std::string() : count_text(count, "force") + " ended";
}

std::string done_text(const Operation& operation, std::string_view argument) {
  return fmt::format(fmt::runtime(operation.done), argument);
}

}  // namespace plchost
