#include "manager/supervisor/supervisor.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/toml/section_reader.hpp"

namespace plchost {

Supervisor::Supervisor(const std::vector<InstanceConfig>& instances,
                       ManagedInstance::Surroundings surroundings, HostFactory make_host)
    : surroundings_(std::move(surroundings)), make_host_(std::move(make_host)) {
  for (const InstanceConfig& instance : instances) add(instance);
  link();
}

Supervisor::Unit& Supervisor::add(const InstanceConfig& config) {
  units_.push_back(make_unit(config, free_place()));
  return *units_.back();
}

std::unique_ptr<Supervisor::Unit> Supervisor::make_unit(const InstanceConfig& config, std::size_t place) {
  auto made = std::make_unique<Unit>();
  Unit* const unit = made.get();
  HostedInstance hosted = make_host_(config);
  unit->place = place;
  unit->host = std::move(hosted.host);
  unit->applications = std::move(hosted.applications);
  unit->wishes = std::move(hosted.wishes);
  unit->instance = std::make_unique<ManagedInstance>(config, surroundings_,
                                                     ManagedInstance::Own{.host = *unit->host,
                                                                          .applications = *unit->applications,
                                                                          .wishes = *unit->wishes,
                                                                          .place = place,
                                                                          .changed = [this] { advance(); }});
  hosted.connect(*unit->instance);
  return made;
}

Supervisor::Unit* Supervisor::find(std::string_view name) const {
  const auto found =
      std::ranges::find_if(units_, [&](const auto& unit) { return unit->instance->config().name == name; });
  return found == units_.end() ? nullptr : found->get();
}

std::size_t Supervisor::free_place() const {
  std::size_t place = 0;
  while (std::ranges::any_of(units_, [&](const auto& unit) { return unit->place == place; })) ++place;
  return place;
}

// An instance may come after one that was removed meanwhile and is gone.
void Supervisor::link() {
  for (const auto& unit : units_) {
    unit->after.clear();
    unit->before.clear();
  }
  for (const auto& unit : units_) {
    for (const std::string& name : unit->instance->config().after) {
      Unit* const earlier = find(name);
      if (earlier == nullptr) continue;
      unit->after.push_back(earlier);
      earlier->before.push_back(unit.get());
    }
  }
}

bool Supervisor::adopt_removed(const std::string& name) {
  if (units_.size() == kMaxInstances || find(name) != nullptr) return false;
  InstanceConfig config;
  config.name = name;
  config.autostart = false;
  config.restart = RestartPolicy::never;
  Unit& unit = add(config);
  if (unit.instance->known() && unit.instance->adopt()) {
    unit.instance->remove();
    return true;
  }
  units_.pop_back();
  return false;
}

void Supervisor::start() {
  std::vector<bool> adopted;
  for (const auto& unit : units_) {
    adopted.push_back(unit->instance->has_process() || unit->instance->adopt());
  }
  for (std::size_t i = 0; i < units_.size(); ++i) {
    ManagedInstance& instance = *units_[i]->instance;
    surroundings_.observer.changed(units_[i]->place, instance.status());
    if (!adopted[i]) instance.resume();
  }
  advance();
}

void Supervisor::handle(const ControlRequest& request, ControlReplyFunction reply) {
  if (const Unit* const unit = find(request.instance))
    return unit->instance->handle(request, std::move(reply));
  reply(ControlReply{
      .number = request.number,
      .code = ErrorCode::not_found,
      .text = fmt::format("no instance '{}'; there are {}", request.instance.substr(0, kMaxPath), names())});
}

std::string Supervisor::names() const {
  std::vector<std::string_view> names;
  for (const auto& unit : units_) names.emplace_back(unit->instance->config().name);
  return join_names(names);
}

std::vector<InstanceConfig> Supervisor::configs() const {
  std::vector<InstanceConfig> configs;
  for (const auto& unit : units_) configs.push_back(unit->instance->config());
  return configs;
}

void Supervisor::shut_down(std::function<void()> done) {
  shut_down_ = std::move(done);
  // Those that are held or back off must not come up while others end.
  for (const auto& unit : units_) {
    if (!unit->instance->has_process()) {
      unit->ending = true;
      unit->instance->shut_down();
    }
  }
  advance();
}

void Supervisor::when_kept(const std::function<void()>& done) {
  const auto left = std::make_shared<std::size_t>(units_.size() + 1);
  const auto one_less = [left, done](const std::string& /*problem*/) {
    if (--*left == 0) done();
  };
  for (const auto& unit : units_) unit->wishes->when_kept(one_less);
  one_less("");
}

void Supervisor::refresh() {
  for (const auto& unit : units_) {
    unit->host->read_output();
    unit->instance->refresh();
  }
  if (!shut_down_) forget_gone();
}

// Starting one instance changes it, which comes back here: the outermost call does all the work.
void Supervisor::advance() {
  changed_again_ = true;
  if (std::exchange(advancing_, true)) return;
  while (std::exchange(changed_again_, false)) {
    if (shut_down_) {
      advance_end();
    } else {
      for (const auto& unit : units_) {
        if (unit->instance->held()) advance_start(*unit);
      }
    }
  }
  advancing_ = false;
  const bool over = shut_down_ && std::ranges::none_of(units_, [](const auto& unit) {
                      return !unit->ending || unit->instance->has_process();
                    });
  if (over) std::exchange(shut_down_, nullptr)();
}

void Supervisor::advance_start(Unit& unit) {
  std::string missing;
  for (const Unit* const other : unit.after) {
    const ManagedInstance& earlier = *other->instance;
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
  for (const auto& unit : units_) {
    const bool free =
        std::ranges::none_of(unit->before, [](const Unit* later) { return later->instance->has_process(); });
    if (!free || std::exchange(unit->ending, true)) continue;
    unit->instance->shut_down();
  }
}

}  // namespace plchost
