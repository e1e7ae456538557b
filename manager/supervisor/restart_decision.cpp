#include "manager/supervisor/restart_decision.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace plchost {

namespace {

using Action = Decision::Action;

struct DecisionRow {
  enum class Counts : std::uint8_t { nothing, end, crash, forget };
  EndCause cause;
  Counts counts;            // in the history
  bool follows_autostart;   // "begun": the manager has just begun, or has read its configuration again
  bool blames_application;  // "blame": ends in set-up, while an application that was loaded is new
  Action never;             // by the restart policy
  Action on_failure;
  Action always;
  Action stopped;  // by an operator while it had no process, or begun by nobody
  Action removed;  // from the configuration
};

constexpr auto kDecisionRows = [] {
  using enum Decision::Action;
  using enum EndCause;
  using Counts = DecisionRow::Counts;
  // clang-format off
  return std::array<DecisionRow, kEndCauses>{{
      // cause             counts           begun  blame  never           on_failure      always          stopped     removed
      {exited,              Counts::crash,   false, true,  fail,           back_off,       back_off,       go_offline, fail},
      {killed,              Counts::crash,   false, true,  fail,           back_off,       back_off,       go_offline, fail},
      {unknown,             Counts::crash,   false, true,  fail,           back_off,       back_off,       go_offline, fail},
      {unwatched,           Counts::crash,   true,  false, fail,           back_off,       back_off,       go_offline, fail},
      {start_refused,       Counts::end,     false, true,  fail,           fail,           back_off,       go_offline, fail},
      {start_transient,     Counts::end,     false, false, fail,           back_off,       back_off,       go_offline, fail},
      {declaration_taken,   Counts::end,     false, true,  fail,           back_off,       back_off,       go_offline, fail},
      {limit_met,           Counts::end,     false, true,  fail,           back_off,       back_off,       go_offline, fail},
      {name_taken,          Counts::end,     false, false, back_off,       back_off,       back_off,       go_offline, fail},
      {exception,           Counts::nothing, false, false, leave,          leave,          leave,          leave,      leave},
      {silent,              Counts::nothing, false, false, leave,          leave,          leave,          leave,      leave},
      {adoption_unanswered, Counts::nothing, false, false, leave,          leave,          leave,          leave,      leave},
      {idle,                Counts::nothing, false, false, leave,          leave,          leave,          leave,      bring_down},
      {operators_stop,      Counts::nothing, false, false, leave,          leave,          leave,          leave,      bring_down},
      {stop_of_waiting,     Counts::nothing, false, false, go_offline,     go_offline,     go_offline,     go_offline, go_offline},
      {replaced,            Counts::forget,  false, false, start_now,      start_now,      start_now,      start_now,  start_now},
      {told_to_end,         Counts::nothing, false, false, go_offline,     go_offline,     go_offline,     go_offline, go_offline},
      {manager_ends,        Counts::nothing, false, false, bring_down,     bring_down,     bring_down,     bring_down, bring_down},
      {never_begun,         Counts::nothing, true,  false, start_in_order, start_in_order, start_in_order, leave,      leave},
      {without_process,     Counts::nothing, true,  false, start_in_order, start_in_order, start_in_order, go_offline, go_offline},
      {setting_up_unknown,  Counts::nothing, true,  false, await_process,  start_in_order, start_in_order, go_offline, go_offline},
      {host_ended,          Counts::nothing, true,  false, fail,           start_in_order, start_in_order, go_offline, go_offline},
      {given_up,            Counts::nothing, true,  false, fail,           fail,           fail,           fail,       fail},
      {wish_unreadable,     Counts::nothing, true,  false, fail,           fail,           fail,           fail,       fail},
      {reconfigured,        Counts::nothing, true,  false, start_in_order, start_in_order, start_in_order, leave,      leave},
  }};
  // clang-format on
}();

constexpr bool in_order_of_causes() {
  for (std::size_t i = 0; i < kDecisionRows.size(); ++i) {
    if (static_cast<std::size_t>(kDecisionRows[i].cause) != i) return false;
  }
  return true;
}
static_assert(in_order_of_causes(), "each cause has one row");

Action by_policy(const DecisionRow& row, const InstanceConfig& policy) {
  switch (policy.restart) {
    case RestartPolicy::never:
      // The configuration starts it with its host all the same.
      return row.cause == EndCause::host_ended && policy.autostart ? Action::start_in_order : row.never;
    case RestartPolicy::on_failure:
      return row.on_failure;
    case RestartPolicy::always:
      return row.always;
  }
  return row.never;
}

Action action_of(const DecisionRow& row, const End& end, const InstanceConfig& policy) {
  if (end.has_earlier && row.blames_application) return Action::start_earlier;
  if (end.order == Order::no_process) return row.stopped;
  if (end.removed) return row.removed;
  const bool may_begin = end.order != Order::none || policy.autostart;
  return may_begin || !row.follows_autostart ? by_policy(row, policy) : row.stopped;
}

void forget_old(RestartHistory& history, TimePoint now, const InstanceConfig& policy) {
  auto& crashes = history.crashes;
  std::erase_if(crashes, [&](TimePoint crash) { return now - crash > policy.crash_window; });
  if (crashes.size() > policy.crash_limit) {
    crashes.erase(crashes.begin(), crashes.end() - static_cast<std::ptrdiff_t>(policy.crash_limit));
  }
}

void count(RestartHistory& history, const End& end, bool crash, const InstanceConfig& policy) {
  // A process that stayed up for a whole window has recovered.
  if (end.lasted >= policy.crash_window) history.in_a_row = 0;
  ++history.in_a_row;
  if (crash) history.crashes.push_back(end.at);
  forget_old(history, end.at, policy);
}

// restart_delay, doubled for each end in a row before the last, up to restart_delay_max.
Duration delay_after(const RestartHistory& history, const InstanceConfig& policy) {
  constexpr std::uint32_t kMostDoublings = 20;  // far beyond any allowed ratio of the two delays
  const std::uint32_t doublings = history.in_a_row == 0 ? 0 : std::min(history.in_a_row - 1, kMostDoublings);
  return std::min(policy.restart_delay_max, policy.restart_delay * (std::int64_t{1} << doublings));
}

}  // namespace

Decision decide(const End& end, const RestartHistory& history, const InstanceConfig& policy) {
  const DecisionRow& row = kDecisionRows.at(static_cast<std::size_t>(end.cause));
  Decision made{.action = action_of(row, end, policy),
                .runs = end.order == Order::none || end.order == Order::run,
                .delay = Duration::zero(),
                .crash = false,
                .history = history};
  // An operator has taken matters in hand.
  if (row.counts == DecisionRow::Counts::forget) made.history = {};
  const bool crash = row.counts == DecisionRow::Counts::crash;
  if ((crash || row.counts == DecisionRow::Counts::end) && made.action != Action::start_earlier) {
    count(made.history, end, crash, policy);
  }
  made.crash = crash && policy.restart != RestartPolicy::never && made.action != Action::start_earlier;
  if (made.crash && made.history.crashes.size() >= policy.crash_limit) made.history.safe_mode = true;
  if (made.action == Action::back_off) made.delay = delay_after(made.history, policy);
  if (made.action == Action::await_process) made.delay = policy.restart_delay;
  return made;
}

EndCause cause_of(const ExitStatus& status) noexcept {
  if (!status.known) return EndCause::unknown;
  return status.kind == ExitStatus::Kind::exited ? EndCause::exited : EndCause::killed;
}

RestartHistory restored_history(TimePoint now, const std::vector<Duration>& ages, std::uint32_t in_a_row,
                                bool safe_mode, const InstanceConfig& policy) {
  RestartHistory history{.crashes = {}, .in_a_row = in_a_row, .safe_mode = safe_mode};
  for (const Duration age : ages) {
    // A clock that was set back makes an age negative: then the crash is a young one.
    if (age <= policy.crash_window) history.crashes.push_back(now - std::max(age, Duration::zero()));
  }
  forget_old(history, now, policy);
  return history;
}

}  // namespace plchost
