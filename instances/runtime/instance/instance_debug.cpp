// How the application of an Instance is debugged: see instances/runtime/debug/debug_service.hpp.

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/instance/instance.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// The state is shown to the debugger no more often.
constexpr auto kShowPause = std::chrono::milliseconds(10);

}  // namespace

Result<void> Instance::attach_debugger() {
  if (host_->declaration().pous.pous().empty()) return {};
  if (options_.launch.no_debug)
    return failure(ErrorCode::refused,
                   "the application is a debug build, and this host says allow_debug = false");
  auto page = DebugPage::create(options_.launch.pool, options_.launch.name);
  if (!page) {  // the machine runs all the same
    spdlog::error("no task can be halted by a debugger: {}", page.error().describe());
    return {};
  }
  debug_page_.emplace(*std::move(page));
  PLCHOST_TRY(
      host_->debug().attach({.tasks = tasks_.get(),
                             .pous = [this]() -> const auto& { return host_->declaration().pous; },
                             .variables = [this]() -> const auto& { return host_->variables().access(); },
                             .before_go = [this] { show_halts(); }}));
  show_debug_state();
  spdlog::warn("the application is a debug build: engineers can halt its tasks");
  return {};
}

bool Instance::has_debugger() const noexcept {
  return host_ && host_->debug().attached();
}

Result<std::string> Instance::debug(const std::string& command) {
  hear_debugger();
  auto done = host_->debug().obey(command, MonotonicClock::now());
  spdlog::info("debug {}: {}", command, done ? *done : done.error().describe());
  show_debug_state();
  return done;
}

// A stranger may have written a time that is still to come: it would count for ever.
void Instance::hear_debugger() {
  if (!debug_page_) return;
  const auto asked = debug_page_->asked();
  if (asked.when <= MonotonicClock::now()) host_->debug().seen(asked.session, asked.when);
}

void Instance::advance_debugger() {
  if (!has_debugger() || !debug_page_) return;
  hear_debugger();
  const TimePoint now = MonotonicClock::now();
  host_->debug().advance(now);
  show_halts();
  if (now < debug_shown_ + kShowPause) return;
  debug_shown_ = now;
  show_debug_state();
}

void Instance::show_debug_state() {
  if (debug_page_) debug_page_->write(host_->debug().state(kMaxDebugState));
}

// Outputs of tasks that halt are safe: see SafeOutputs. Not while all are let go for a stop, which puts its
// own state.
void Instance::show_halts() noexcept {
  if (host_->debug().suspended()) return;
  host_->areas().outputs().halt([this](std::size_t task) { return host_->debug().halts(task); });
}

void Instance::let_tasks_go(std::string_view why) {
  if (!has_debugger()) return;
  let_go_ += host_->debug().suspend(why);
  show_debug_state();  // before the reply
}

void Instance::let_tasks_go_on(std::string_view why) {
  host_->areas().outputs().halt([](std::size_t /*task*/) { return false; });
  let_tasks_go(why);
}

void Instance::resume_debugging() {
  if (life_.state() == ApplicationState::running) begin_debugging();
}

void Instance::begin_debugging() {
  if (!has_debugger()) return;
  host_->debug().resume(scheduler_);
  show_debug_state();  // before the reply
}

std::string Instance::take_let_go() {
  const std::size_t count = std::exchange(let_go_, 0);
  return count == 0 ? std::string()
                    : count_text(count, "halted task was", "halted tasks were") + " let go first";
}

std::string Instance::with_let_go(const std::string& text) {
  const std::string told = take_let_go();
  return told.empty() ? text : fmt::format("{}; {}", text, told);
}

}  // namespace plchost
