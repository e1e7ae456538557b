#include "manager/supervisor/supervisor.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/lost_faults.hpp"
#include "shm/base/names.hpp"
#include "shm/base/toml/section_reader.hpp"

namespace plchost {

Supervisor::Supervisor(const ManagerConfig& config, Surroundings surroundings, const HostFactory& make_host)
    : surroundings_(std::move(surroundings)), units_(config.instances.size()) {
  for (std::size_t i = 0; i < units_.size(); ++i) {
    const InstanceConfig& instance = config.instances[i];
    HostedInstance hosted = make_host(instance);
    units_[i].host = std::move(hosted.host);
    units_[i].applications = std::move(hosted.applications);
    units_[i].wishes = std::move(hosted.wishes);
    units_[i].instance = std::make_unique<ManagedInstance>(
        instance,
        ManagedInstance::Surroundings{
            .host = config.host,
            .applications = *units_[i].applications,
            .wishes = *units_[i].wishes,
            .folder = surroundings_.folder,
            .schedulers = surroundings_.schedulers,
            .now = surroundings_.now,
            .changed = [this, i] { changed(i); },
            .keep_lost_faults =
                [&host = config.host, &instance] {
                  return keep_lost_faults(host.pool, host.run_directory, instance.name);
                },
            .transition =
                [this, i](InstanceState from, InstanceState to, std::string_view reason) {
                  if (surroundings_.transition) {
                    surroundings_.transition(i, from, to, reason);
                  }
                }},
        *units_[i].host);
    hosted.connect(*units_[i].instance);
    for (const std::string& name : instance.after) {
      const auto found = std::ranges::find(config.instances, name, &InstanceConfig::name);
      const auto other = static_cast<std::size_t>(found - config.instances.begin());
      units_[i].after.push_back(other);
      units_[other].before.push_back(i);
    }
  }
}

void Supervisor::start() {
  std::vector<bool> adopted;
  for (Unit& unit : units_) adopted.push_back(unit.instance->adopt());
  for (std::size_t i = 0; i < units_.size(); ++i) {
    ManagedInstance& instance = *units_[i].instance;
    surroundings_.publish(i, instance.status());
    if (!adopted[i]) instance.resume();
  }
  advance();
}

void Supervisor::handle(const ControlRequest& request, ControlReplyFunction reply) {
  const auto found = std::ranges::find_if(
      units_, [&](const Unit& unit) { return unit.instance->config().name == request.instance; });
  if (found != units_.end()) return found->instance->handle(request, std::move(reply));
  reply(ControlReply{
      .number = request.number,
      .code = ErrorCode::not_found,
      .text = fmt::format("no instance '{}'; there are {}", request.instance.substr(0, kMaxPath), names())});
}

std::string Supervisor::names() const {
  std::vector<std::string_view> names;
  for (const Unit& unit : units_) names.emplace_back(unit.instance->config().name);
  return join_names(names);
}

void Supervisor::shut_down(std::function<void()> done) {
  shut_down_ = std::move(done);
  // Those that are held or back off must not come up while others end.
  for (Unit& unit : units_) {
    if (!unit.instance->has_process()) {
      unit.ending = true;
      unit.instance->shut_down();
    }
  }
  advance();
}

void Supervisor::when_kept(const std::function<void()>& done) {
  const auto left = std::make_shared<std::size_t>(units_.size() + 1);
  const auto one_less = [left, done](const std::string& /*problem*/) {
    if (--*left == 0) done();
  };
  for (Unit& unit : units_) unit.wishes->when_kept(one_less);
  one_less("");
}

void Supervisor::refresh() {
  for (Unit& unit : units_) unit.instance->refresh();
}

void Supervisor::changed(std::size_t index) {
  surroundings_.publish(index, units_[index].instance->status());
  advance();
}

// Starting one instance changes it, which comes back here: the outermost call does all the work.
void Supervisor::advance() {
  changed_again_ = true;
  if (std::exchange(advancing_, true)) return;
  while (std::exchange(changed_again_, false)) {
    if (shut_down_) {
      advance_end();
    } else {
      for (Unit& unit : units_) {
        if (unit.instance->held()) advance_start(unit);
      }
    }
  }
  advancing_ = false;
  const bool over = shut_down_ && std::ranges::none_of(units_, [](const Unit& unit) {
                      return !unit.ending || unit.instance->has_process();
                    });
  if (over) std::exchange(shut_down_, nullptr)();
}

void Supervisor::advance_start(Unit& unit) {
  std::string missing;
  for (const std::size_t other : unit.after) {
    const ManagedInstance& earlier = *units_[other].instance;
    if (earlier.ready()) continue;
    missing += fmt::format("{}'{}', which is {}", missing.empty() ? "waits for " : ", ",
                           earlier.config().name, to_string(earlier.status().state));
    const bool for_good =
        earlier.status().state == InstanceState::failed || earlier.status().state == InstanceState::safe_mode;
    if (for_good) missing += fmt::format(" ({})", earlier.status().problem.view());
  }
  if (missing.empty()) {
    unit.instance->release();
  } else {
    unit.instance->hold(missing);
  }
}

void Supervisor::advance_end() {
  for (Unit& unit : units_) {
    const bool free = std::ranges::none_of(
        unit.before, [&](std::size_t later) { return units_[later].instance->has_process(); });
    if (!free || std::exchange(unit.ending, true)) continue;
    unit.instance->shut_down();
  }
}

}  // namespace plchost
