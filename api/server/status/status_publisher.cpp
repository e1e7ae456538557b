#include "api/server/status/status_publisher.hpp"

#include <algorithm>
#include <utility>

#include <code_words.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "api/dds/field_info.hpp"
#include "api/dds/text.hpp"
#include "api/server/status/instance_runtime.hpp"

namespace plchost {

namespace {

void put_plan(const InstancePlan& plan, plc_InstanceStatus& sample) noexcept {
  dds::copy_text(sample.configured, plan.application.view());
  dds::copy_text(sample.settings, plan.settings.view());
  sample.priority_band = dds::code_for(dds::words::InstanceStatus::priority_band, plan.priority_band.view());
  dds::copy_text(sample.after, plan.after.view());
  sample.autostart = plan.autostart != 0;
  sample.restart_policy = std::to_underlying(plan.restart);
  sample.restart_delay_ns = plan.restart_delay_ns;
  sample.restart_delay_max_ns = plan.restart_delay_max_ns;
  sample.crash_limit = plan.crash_limit;
  sample.crash_window_ns = plan.crash_window_ns;
}

// The external events of these objects. A topic with a sample for each of 100,000 would drown every client;
// see OPERATION_LIST_OBJECTS.
std::vector<ObjectInfo> published_events(std::vector<ObjectInfo> objects) {
  std::erase_if(objects, [](const ObjectInfo& object) {
    return object.type != ObjectType::event || !object.name.contains('/');
  });
  constexpr std::size_t kMost = StatusPublisher::kMostEvents;
  if (objects.size() <= kMost) return objects;
  const auto order = [](const ObjectInfo& event) {
    return std::pair(!event.registered && event.bound_tasks == 0, std::string_view(event.name));
  };
  std::ranges::nth_element(objects, objects.begin() + kMost, {}, order);
  objects.resize(kMost);
  return objects;
}

}  // namespace

Result<StatusPublisher> StatusPublisher::create(dds_entity_t participant, const Source& source) {
  PLCHOST_TRY_ASSIGN(auto publisher_of_status,
                     in_step("cannot publish the status",
                             dds::make_publisher(participant, dds::status_partition(source.host))));
  const dds_entity_t parent = publisher_of_status.get();
  const StatusSource writes{.host = source.host, .epoch = source.epoch};
  PLCHOST_TRY_ASSIGN(auto tables,
                     in_step("cannot publish the status", StatusTables::create(participant, parent, writes)));
  PLCHOST_TRY_ASSIGN(auto hosts, in_step("cannot publish the status",
                                         open_table<plc_HostStatus>(participant, parent, writes)));
  PLCHOST_TRY_ASSIGN(auto findings, in_step("cannot publish the status",
                                            open_table<plc_HostFinding>(participant, parent, writes)));
  auto statistics = dds::open_writer(participant, parent, dds::kTaskStatistics);
  auto presence = dds::open_writer(participant, parent, dds::kPresence);
  for (auto* made : {&statistics, &presence}) {
    if (!*made) return failure_in("cannot publish the status", made->error());
  }
  PLCHOST_TRY_ASSIGN(
      auto transitions,
      TransitionPublisher::create(participant, parent, {source.host, source.pool->name(), source.epoch}));
  StatusTables& of_topics = *tables;
  StatusPublisher publisher(source, std::move(tables),
                            TaskWatch(source.pool->name(), of_topics.of<plc_TaskStatus>(),
                                      StatisticsWriter(source.host, source.epoch, std::move(*statistics))),
                            ExceptionWatch(source.run_directory, of_topics.of<plc_ExceptionStatus>()),
                            std::move(transitions));
  publisher.findings_ = std::move(findings);
  publisher.hosts_ = std::move(hosts);
  publisher.writers_ = WriterWatch(of_topics.of<plc_WriterStatus>());
  publisher.applications_ =
      ApplicationWatch(source.applications_folder, of_topics.of<plc_ApplicationStatus>());
  publisher.losses_ = LossPublisher(source.pool->name(), of_topics.of<plc_LossStatus>());
  publisher.presence_ = std::move(*presence);
  publisher.publisher_ = std::move(publisher_of_status);
  PLCHOST_TRY(publisher.page_.wait(MonotonicClock::now() + kPageWait));
  return publisher;
}

void StatusPublisher::tick(TimePoint now) {
  bool changed = std::exchange(writers_changed_, false);
  (void)page_.refresh();
  changed |= look_at_instances(now);
  if (now >= next_objects_) changed |= look_at_objects(now);
  changed |= applications_.look(instance_names_, now);
  tasks_.look(now);
  findings_.write();
  load_.look(now);
  write_host(changed);
}

void StatusPublisher::look_at_writers(const EventIntake& intake, const SessionTable& sessions,
                                      TimePoint now) {
  writers_changed_ |= writers_.look(intake, sessions, now);
}

bool StatusPublisher::flush(const std::vector<std::string>& instances, TimePoint now) {
  const bool whole = page_.refresh();
  bool changed = look_at_instances(now);
  changed |= look_at_objects(now);
  for (const std::string& instance : instances) {
    changed |= applications_.look_at(instance);
    tasks_.look_at(instance, now);
  }
  write_host(changed);
  return whole;
}

bool StatusPublisher::look_at_instances(TimePoint now) {
  bool changed = false;
  running_ = 0;
  grid_ = {};
  auto& table = tables_->of<plc_InstanceStatus>();
  table.begin_round();
  exceptions_.begin_round();
  std::vector<std::string> names;
  std::string unsaved;
  for (const InstanceStatus* const status : page_.instances()) {
    names.emplace_back(status->name.view());
    changed |= update_instance(*status, now, unsaved);
  }
  changed |= table.dispose_rest();
  changed |= exceptions_.end_round();
  for (const std::string& gone : instance_names_) {
    if (std::ranges::find(names, gone) != names.end()) continue;
    changed |= tasks_.forget(gone);
    transitions_.forget(gone);
    changed |= losses_.forget(gone);
  }
  instance_names_ = std::move(names);
  table.write();
  losses_.write();
  changed |= std::exchange(unsaved_, unsaved) != unsaved;
  return changed;
}

bool StatusPublisher::update_instance(const InstanceStatus& status, TimePoint now, std::string& unsaved) {
  const std::string name(status.name.view());
  bool changed = tasks_.follow(status, now);
  changed |= exceptions_.follow(status, tasks_, now);
  changed |= losses_.follow(status, now);
  plc_InstanceStatus sample = tables_->of<plc_InstanceStatus>().blank();
  dds::copy_text(sample.instance, name);
  sample.state = static_cast<std::uint32_t>(status.state);
  if (status.state == InstanceState::running) ++running_;
  sample.pid = status.pid;
  sample.core = status.core;
  sample.restarts = status.restarts;
  sample.state_since_unix_ns = status.state_since_unix_ns;
  // The process knows best what it runs; the manager knows what it will run.
  const auto runtime = tasks_.runtime(name);
  const bool says = runtime && !runtime->scheduler.view().empty();
  dds::copy_text(sample.scheduler, says ? runtime->scheduler.view() : status.scheduler.view());
  dds::copy_text(sample.application, status.application.view());
  dds::copy_text(sample.problem, problem_of_instance(status, runtime ? &*runtime : nullptr));
  const bool is_its_own = runtime && status.pid != 0 && runtime->pid == status.pid;
  if (is_its_own) {
    dds::copy_text(sample.loaded, runtime->application.view());
    grid_.add(runtime->clock);
  }
  put_plan(status.plan, sample);
  if (is_its_own && !runtime->retain_problem.view().empty()) {
    unsaved += fmt::format("{}{}", unsaved.empty() ? "" : ",", name);
  }
  if (runtime) put_runtime(*runtime, sample);
  sample.transitions = transitions_.publish(name, now);
  sample.unconfigured = status.removed != 0;
  return tables_->of<plc_InstanceStatus>().update(name, sample) || changed;
}

bool StatusPublisher::look_at_objects(TimePoint now) {
  auto listed = source_.pool->list();
  if (!listed) return false;  // the last published state holds until they can be looked at
  const auto count = static_cast<std::uint32_t>(listed->size());
  bool changed = std::exchange(objects_, count) != count;
  auto& events = tables_->of<plc_EventStatus>();
  events.begin_round();
  for (const ObjectInfo& event : published_events(*std::move(listed))) changed |= update_event(event);
  changed |= events.dispose_rest();
  events.write();
  // Of a large pool it takes its time: most of the time is for others.
  constexpr int kRest = 10;
  rested_ = now + kRest * (MonotonicClock::now() - now);
  next_objects_ = std::max(now + kObjectPeriod, rested_);
  return changed;
}

bool StatusPublisher::update_event(const ObjectInfo& event) {
  const std::string_view name(event.name);
  const auto slash = name.find('/');
  plc_EventStatus sample = tables_->of<plc_EventStatus>().blank();
  dds::copy_text(sample.instance, name.substr(0, slash));
  dds::copy_text(sample.event, name.substr(slash + 1));
  sample.registered = event.registered;
  sample.bound_tasks = event.bound_tasks;
  sample.posts = event.value;
  return tables_->of<plc_EventStatus>().update(event.name, sample);
}

void StatusPublisher::publish_findings(const std::vector<HostFinding>& findings) {
  findings_.begin_round();
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const HostFinding& finding = findings[i];
    plc_HostFinding sample = findings_.blank();
    dds::copy_text(sample.id, finding.id);
    sample.round = round_ + 1;
    sample.finding_count = static_cast<std::uint32_t>(findings.size());
    sample.position = static_cast<std::uint32_t>(i);
    sample.level = static_cast<std::uint32_t>(finding.level);
    dds::copy_text(sample.subject, finding.subject);
    dds::copy_text(sample.found, finding.found);
    dds::copy_text(sample.why, finding.why);
    dds::copy_text(sample.advice, finding.advice);
    (void)findings_.update(finding.id, sample);
  }
  (void)findings_.dispose_rest();
  findings_.write();
  write_host(true);
}

void StatusPublisher::write_host(bool changed) {
  if (changed || round_ == 0) ++round_;
  plc_HostStatus sample = hosts_.blank();
  sample.round = round_;
  tables_->count(sample);
  dds::copy_text(sample.version, host().version.view());
  sample.manager_pid = host().manager_pid;
  sample.started_unix_ns = host().started_unix_ns;
  dds::copy_text(sample.labels, source_.labels);
  dds::copy_text(sample.schedulers, host().schedulers.view());
  sample.secured = source_.secured;
  sample.running = running_;
  sample.objects = objects_;
  load_.put(sample);
  grid_.put(sample);
  sample.audit_number = audit_.number;
  dds::copy_text(sample.audit_hash, audit_.hash);
  dds::copy_text(sample.unrecorded, audit_.problem);
  dds::copy_text(sample.rival, rival_);
  dds::copy_text(sample.unsaved, unsaved_);
  (void)hosts_.update(source_.host, sample);
  hosts_.write();
}

void StatusPublisher::set_audit(const AuditState& audit) {
  if (audit == audit_) return;
  audit_ = audit;
  write_host(true);
}

void StatusPublisher::set_rival(std::string rival) {
  if (rival == rival_) return;
  rival_ = std::move(rival);
  write_host(true);
}

void StatusPublisher::write_presence() {
  plc_Presence sample{};
  dds::copy_text(sample.host, source_.host);
  sample.epoch = source_.epoch;
  sample.pid = ::getpid();
  sample.api_version = dds::kApiVersion;
  sample.clock_ns = boot_time_ns();
  (void)dds_write(presence_.writer.get(), &sample);
}

}  // namespace plchost
