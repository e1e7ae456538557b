// How another version of the application takes over while it runs.

#include <utility>

#include <fmt/format.h>

#include "instances/runtime/instance/instance.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// For a moment in which no task is in a cycle. Less than the manager waits for an answer.
constexpr auto kChangePatience = std::chrono::seconds(6);

}  // namespace

// Text: it has taken over. Empty: it will, or not, and the client hears of it then.
Result<std::string> Instance::begin_change(const std::string& path) {
  if (change_) return failure(ErrorCode::busy, "an online change is under way: try again when it is done");
  if (!orders_.empty()) return failure(ErrorCode::busy, "a variable is to be written: try again when it is");
  if (const auto faulty = tasks_->tasks_in_exception(); !faulty.empty()) {
    return failure(ErrorCode::wrong_state,
                   fmt::format("in exception: task {}, which may be in the code that would go; reset first",
                               join_names(faulty)));
  }
  PLCHOST_TRY_ASSIGN(change_, OnlineChange::prepare(path, load_context(), *application_));
  change_ends_ = MonotonicClock::now() + kChangePatience;
  let_tasks_go_on("another version takes over");
  if (const auto held = take_over_now()) return finish_change(*held);
  return {};
}

// A task that halts in the middle of a cycle would go on in code that is gone. A thread that a fault has
// ended has its stack in there.
std::optional<Duration> Instance::take_over_now() {
  bool whole = false;
  const auto held = tasks_->between_cycles([&] {
    whole = !tasks_->stands_still() && !tasks_->has_parked_thread();
    if (whole) change_->take_over();
  });
  return whole ? held : std::nullopt;
}

void Instance::advance_change() {
  if (const auto faulty = tasks_->tasks_in_exception(); !faulty.empty()) {
    return drop_change(fmt::format("in exception: task {}", join_names(faulty)));
  }
  if (const auto held = take_over_now()) {
    const std::string text = finish_change(*held);
    beat();
    return answer_waiting(ErrorCode::ok, text);
  }
  if (MonotonicClock::now() < change_ends_) return;
  const auto busy = tasks_->tasks_in_cycle();
  const std::string last = busy.empty() ? std::string() : fmt::format(", the last time {}", join_names(busy));
  drop_change(
      fmt::format("at each look for {} s a task was within its cycle{}", kChangePatience.count(), last));
}

std::string Instance::finish_change(Duration held) {
  const std::string before = change_->path();  // it holds the version before now
  const std::string carried = change_->describe();
  // The callbacks find the new version in application_.
  change_->finish([this] { notify_tasks(EVT_ExternalEventTaskCreateDone); });
  change_.reset();
  if (auto shown = host_->variables().publish(options_.launch.pool, options_.launch.name); !shown)
    spdlog::error("{}; the variables of the new version cannot be seen", shown.error().describe());
  const double us = std::chrono::duration<double, std::micro>(held).count();
  life_.stay(fmt::format("online change to {}", application_->path()));
  resume_debugging();
  std::string text = take_let_go();
  if (!text.empty()) text += "; ";
  text += fmt::format("taken over between two cycles, within {:.0f} us: {}", us, carried);
  spdlog::info("online change from {} to {}: {}", before, application_->path(), text);
  return text;
}

// Nothing is changed.
void Instance::drop_change(const std::string& why) {
  if (!change_) return;
  const std::string path = change_->path();
  change_.reset();
  resume_debugging();
  answer_waiting(ErrorCode::refused,
                 with_let_go(fmt::format("{} has not taken over: {}; nothing is changed", path, why)));
}

}  // namespace plchost
