// How the Supervisor takes over another configuration while instances run.

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "manager/config/config_changes.hpp"
#include "manager/supervisor/supervisor.hpp"

namespace plchost {

namespace {

bool has(const std::vector<InstanceConfig>& instances, std::string_view name) {
  return std::ranges::find(instances, name, &InstanceConfig::name) != instances.end();
}

std::string removal_text(const ManagedInstance& instance) {
  std::string text = fmt::format("instance '{}': removed", instance.config().name);
  if (!instance.has_process()) return text;
  if (instance.status().state == InstanceState::stopping) return text + "; its process ends";
  return text + "; it runs until it is stopped";
}

std::string keys_of(const std::vector<KeyChange>& changes, TakesEffect when) {
  std::vector<std::string_view> keys;
  for (const KeyChange& change : changes) {
    if (change.when == when) keys.emplace_back(change.key);
  }
  return fmt::format("{}", fmt::join(keys, ", "));
}

}  // namespace

Result<void> Supervisor::check_room(const std::vector<InstanceConfig>& now) const {
  const auto removed = std::ranges::count_if(
      units_, [&](const auto& unit) { return !has(now, unit->instance->config().name); });
  if (now.size() + static_cast<std::size_t>(removed) <= kMaxInstances) return {};
  return failure(ErrorCode::full,
                 fmt::format("{} instances are removed and {} would be configured; allowed are {} together: "
                             "reload a file without the new ones first, and stop those that are removed",
                             removed, now.size(), kMaxInstances));
}

void Supervisor::use_log_level() {
  for (const auto& unit : units_) unit->instance->use_log_level();
}

std::vector<std::string> Supervisor::tell_debug_builds() const {
  const std::string_view effect =
      surroundings_.host.allow_debug
          ? "a debugger can halt its tasks again"
          : "it runs on, sets no new breakpoints, and its next start or load of such a "
            "build is refused";
  std::vector<std::string> lines;
  for (const auto& unit : units_) {
    if (!unit->instance->has_process() || !unit->host->can_be_debugged()) continue;
    lines.push_back(
        fmt::format("instance '{}': runs a debug build; {}", unit->instance->config().name, effect));
  }
  return lines;
}

std::vector<std::string> Supervisor::reload(const std::vector<InstanceConfig>& now) {
  std::vector<std::string> lines;
  for (const auto& unit : units_) {
    ManagedInstance& instance = *unit->instance;
    if (instance.removed() || has(now, instance.config().name)) continue;
    instance.remove();
    lines.push_back(removal_text(instance));
  }
  std::vector<Unit*> fresh;
  for (const InstanceConfig& config : now) {
    if (Unit* const unit = find(config.name)) {
      tell_changes(*unit, config, lines);
    } else {
      fresh.push_back(&add(config));
    }
  }
  link();
  for (const Unit* const unit : fresh) {
    surroundings_.observer.changed(unit->place, unit->instance->status());
    if (!unit->instance->adopt()) unit->instance->resume();
    lines.push_back(fmt::format("instance '{}': new", unit->instance->config().name));
  }
  advance();
  return lines;
}

void Supervisor::tell_changes(Unit& unit, const InstanceConfig& now, std::vector<std::string>& lines) {
  ManagedInstance& instance = *unit.instance;
  const bool returns = instance.removed();
  const auto changes = changed_keys(instance.config(), now);
  if (!returns && changes.empty()) return;
  instance.reconfigure(now);
  const auto tell = [&](const std::string& text) {
    lines.push_back(fmt::format("instance '{}': {}", now.name, text));
  };
  if (returns) {
    const std::string awaited = instance.awaited_changes();
    return tell("in the configuration again" + (awaited.empty() ? "" : "; " + awaited));
  }
  if (const std::string keys = keys_of(changes, TakesEffect::at_once); !keys.empty()) {
    tell(change_text(keys, describe(TakesEffect::at_once)));
  }
  if (const std::string keys = keys_of(changes, TakesEffect::next_process); !keys.empty()) {
    const bool boots = !unit.applications->boot().empty() && keys.find("application") != std::string::npos;
    tell(change_text(keys, describe(TakesEffect::next_process)) +
         (boots ? "; its boot application stays in the place of the configuration's" : ""));
  }
  if (const std::string keys = keys_of(changes, TakesEffect::next_start); !keys.empty()) {
    tell(change_text(keys, describe(TakesEffect::next_start)));
  }
}

void Supervisor::forget_gone() {
  const TimePoint now = surroundings_.now();
  const auto over = [&](const std::unique_ptr<Unit>& unit) {
    if (!unit->instance->gone()) unit->gone_since.reset();
    if (!unit->instance->gone() || unit->wishes->is_writing()) return false;
    if (!unit->gone_since) unit->gone_since = now;
    return now - *unit->gone_since >= kGoneShown;
  };
  const auto first = std::ranges::stable_partition(units_, std::not_fn(over)).begin();
  if (first == units_.end()) return;
  const std::vector<std::unique_ptr<Unit>> ended(std::make_move_iterator(first),
                                                 std::make_move_iterator(units_.end()));
  units_.erase(first, units_.end());
  link();
  for (const auto& unit : ended) {
    surroundings_.observer.gone(unit->place, unit->instance->config());
  }
  advance();
}

}  // namespace plchost
