#include "instances/runtime/application/online_change.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/application/compare_versions.hpp"
#include "shm/base/names.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

// As many as a reply has room for.
std::string first_of(const std::vector<std::string>& lines, std::string_view between) {
  constexpr std::size_t kMost = 8;
  std::string text = fmt::format(
      "{}", fmt::join(lines.begin(),
                      lines.begin() + static_cast<std::ptrdiff_t>(std::min(lines.size(), kMost)), between));
  if (lines.size() > kMost) text += fmt::format("{}and {} more", between, lines.size() - kMost);
  return text;
}

void copy_figures(const Task_Info& from, Task_Info& to) noexcept {
  to.tLastCycleTime = from.tLastCycleTime;
  to.tAverageCycleTime = from.tAverageCycleTime;
  to.tMaxCycleTime = from.tMaxCycleTime;
  to.tMinCycleTime = from.tMinCycleTime;
  to.tJitterMax = from.tJitterMax;
  to.tJitterLast = from.tJitterLast;
}

}  // namespace

Result<std::unique_ptr<OnlineChange>> OnlineChange::prepare(const std::string& path,
                                                            const LoadContext& context,
                                                            Application& running) {
  const TimePoint begin = MonotonicClock::now();
  PLCHOST_TRY_ASSIGN(auto next, declare_application(path, context));
  // From here on its destructor ends the new version.
  std::unique_ptr<OnlineChange> change(new OnlineChange(running, std::move(next.application), context.host));
  if (const Duration took = MonotonicClock::now() - begin; took > kLongestSetup) {
    return failure(ErrorCode::timed_out,
                   fmt::format("{} cannot take over online: its set-up took {:.1f} s, allowed are {:.0f} s; "
                               "nothing is changed; load it without --online",
                               path, std::chrono::duration<double>(took).count(),
                               std::chrono::duration<double>(kLongestSetup).count()));
  }
  PLCHOST_TRY(change->compare(next.declaration));
  change->variables_ = context.host.variables().prepare(next.declaration.seen.take());
  PLCHOST_TRY_ASSIGN(auto commit, Commit::prepare(context, change->next_, std::move(next.declaration)));
  change->commit_.emplace(std::move(commit));
  change->connect();
  return change;
}

OnlineChange::~OnlineChange() {
  commit_.reset();
  next_.leave(host_);  // or the version before
}

Result<void> OnlineChange::compare(const ApplicationDeclaration& declaration) const {
  std::vector<std::string> lines;
  if (next_.name() != running_.name()) {
    lines.push_back(fmt::format("it is the application '{}', '{}' runs", next_.name(), running_.name()));
  }
  const auto add = [&](std::vector<std::string> more) { std::ranges::move(more, std::back_inserter(lines)); };
  add(compare_tasks(running_.tasks(), next_.tasks()));
  std::vector<VariableSymbol> next;
  std::ranges::transform(declaration.seen.variables(), std::back_inserter(next), &DeclaredVariable::symbol);
  std::ranges::sort(next, [](const VariableSymbol& left, const VariableSymbol& right) {
    return compare_variable_names(left.name, right.name) < 0;
  });
  const SeenByBoth seen{.running = host_.variables().access().symbols(), .next = next};
  add(compare_areas(host_.areas().declared(), declaration.areas, seen));
  add(compare_variables(host_.declaration().variables, declaration.variables, seen));
  if (lines.empty()) return {};
  return failure(ErrorCode::refused,
                 fmt::format("{} cannot take over online: {}; nothing is changed; load it without --online",
                             next_.path(), first_of(lines, "; ")));
}

void OnlineChange::connect() {
  const auto& variables = commit_->declaration().variables;
  for (const TaskConfig& task : running_.tasks()) {
    const auto same = std::ranges::find(next_.tasks(), task.name, &TaskConfig::name);
    codes_.push_back(next_.codes()[static_cast<std::size_t>(same - next_.tasks().begin())]);
    infos_.push_back(codes_.back()->info);
  }
  for (const auto& [name, carried] : host_.declaration().variables) {
    const auto same = variables.find(name);
    if (same == variables.end() || carried.bytes == 0) continue;
    copies_.push_back({.to = same->second.address, .from = carried.address, .bytes = carried.bytes});
    copied_.push_back(name);
  }
}

void OnlineChange::take_over() noexcept {
  for (const Copy& copy : copies_) std::memcpy(copy.to, copy.from, copy.bytes);
  for (std::size_t i = 0; i < codes_.size(); ++i) {
    TaskCode& code = *running_.codes()[i];
    copy_figures(*code.info, *codes_[i]->info);
    code = *codes_[i];
  }
  host_.task_table().exchange(infos_);
  host_.variables().take_over(variables_);
  running_.exchange(next_);
}

void OnlineChange::finish(const std::function<void()>& notify) {
  // next_ is the version before now.
  commit_->hold([this](const void* code) { return next_.contains(code); });
  notify();
  host_.end_takeover();
}

std::string OnlineChange::describe() const {
  std::size_t bytes = 0;
  for (const Copy& copy : copies_) bytes += copy.bytes;
  std::string text = fmt::format(
      "{} on, {}", count_text(host_.areas().declared().size(), "area goes", "areas go"),
      copied_.empty()
          ? std::string("no variables were carried over")
          : fmt::format("variables {} were carried over ({} bytes)", first_of(copied_, ", "), bytes));
  if (!variables_.ended.empty())
    text += fmt::format("; {}, of variables that are not the same: {}",
                        ended_forces_text(variables_.ended.size()), first_of(variables_.ended, ", "));
  return text;
}

}  // namespace plchost
