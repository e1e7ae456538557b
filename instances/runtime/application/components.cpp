#include "instances/runtime/application/components.hpp"

#include <array>
#include <bit>
#include <exception>
#include <ranges>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "instances/plc_app.h"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

using Hook = RTS_RESULT (*)(unsigned, unsigned long, unsigned long);

constexpr std::array<std::string_view, 1> kHookExport = {"HookFunction"};

RTS_RESULT call(const SharedObject& object, unsigned hook) {
  try {
    return std::bit_cast<Hook>(object.find("HookFunction"))(hook, 0, 0);
  } catch (const std::exception& error) {
    spdlog::error("component {}: HookFunction threw: {}", object.path(), error.what());
  } catch (...) {
    spdlog::error("component {}: HookFunction threw an exception", object.path());
  }
  return ERR_FAILED;
}

}  // namespace

Result<void> Components::call_all(const InitHook& hook) const {
  for (const SharedObject& object : objects_) {
    if (const RTS_RESULT result = call(object, hook.number); result != ERR_OK) {
      return failure(ErrorCode::refused, fmt::format("component {}: its hook {} returned {:#06x}",
                                                     object.path(), hook.name, result));
    }
  }
  return {};
}

Result<void> Components::load(const std::vector<std::string>& files) {
  for (const std::string& file : files) {
    PLCHOST_TRY_ASSIGN(auto object, in_step("component", SharedObject::load(file, kHookExport)));
    objects_.push_back(std::move(object));
  }
  return {};
}

void* Components::find(const char* symbol) const noexcept {
  for (const SharedObject& object : objects_) {
    if (void* const found = object.find(symbol)) return found;
  }
  return nullptr;
}

Result<void> Components::init() {
  constexpr std::array kHooks = {InitHook{CH_INIT, "CH_INIT"}, InitHook{CH_INIT2, "CH_INIT2"},
                                 InitHook{CH_INIT3, "CH_INIT3"}};
  if (objects_.empty()) return {};
  for (const InitHook& hook : kHooks) {
    reached_ = hook.number;
    if (auto called = call_all(hook); !called) {
      exit();
      return called;
    }
  }
  return {};
}

Result<void> Components::check() {
  return call_all({CH_TRIAL, "CH_TRIAL"});
}

void Components::exit() {
  // CH_EXIT3 undoes CH_INIT3, and so on.
  constexpr std::array kPairs = {std::pair{CH_INIT3, CH_EXIT3}, std::pair{CH_INIT2, CH_EXIT2},
                                 std::pair{CH_INIT, CH_EXIT}};
  for (const auto& [init, undo] : kPairs) {
    if (reached_ < init) continue;
    for (const SharedObject& object : std::views::reverse(objects_)) {
      if (call(object, undo) != ERR_OK) spdlog::warn("component {}: an exit hook failed", object.path());
    }
  }
  reached_ = 0;
}

}  // namespace plchost
