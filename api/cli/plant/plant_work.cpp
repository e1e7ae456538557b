#include "api/cli/plant/plant_work.hpp"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/plant/plant_changes.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

using Kind = PlantFinding::Result;
using Instances = std::map<std::string, PresentInstance>;

// Some changes show only when others are done. In the round after the last one nothing may be left.
constexpr int kRounds = 3;

Result<Instances> look_at(ControlClient& client, const WantedHost& wanted, TimePoint deadline) {
  Instances present;
  PLCHOST_TRY_ASSIGN(const auto instances, client.instances(wanted.name, deadline));
  for (const plc_InstanceStatus& status : instances) {
    present[std::string(dds::text_of(status.instance))] = {
        .state = status.state,
        .scheduler = std::string(dds::text_of(status.scheduler)),
        .application = std::string(dds::text_of(status.application)),
        .events = {}};
  }
  const bool events_count = std::ranges::any_of(
      wanted.instances, [](const WantedInstance& instance) { return !instance.events.empty(); });
  if (!events_count) return present;
  PLCHOST_TRY_ASSIGN(const auto events, client.events(wanted.name, deadline));
  for (const plc_EventStatus& event : events) {
    const auto found = present.find(std::string(dds::text_of(event.instance)));
    if (event.registered && found != present.end()) found->second.events.emplace(dds::text_of(event.event));
  }
  return present;
}

/// Brings one host to what it is to be.
class HostWork {
 public:
  HostWork(const WantedHost& wanted, const HostSelection& selection, const PlantWork& work)
      : wanted_(wanted), selection_(selection), work_(work) {}

  std::vector<PlantFinding> run(ParticipantSource& participant);
  /// Changes nothing: only finds what the host must have, and has not.
  std::vector<PlantFinding> check(ParticipantSource& participant);

 private:
  bool enter(ParticipantSource& participant);
  /// Whether the host has all schedulers that the file names. A host of an older version does not say.
  bool has_schedulers();
  /// Whether something was changed, so that it is worth to look again.
  bool look_at_all();
  bool look_at_one(const WantedInstance& wanted, const PresentInstance& present);
  bool change(const WantedInstance& wanted, const PlantChange& change);
  void tell(Kind result, const WantedInstance* instance, std::string remark,
            const PlantChange* change = nullptr);

  const WantedHost& wanted_;
  const HostSelection& selection_;
  const PlantWork& work_;
  std::unique_ptr<ControlClient> client_;
  std::vector<std::string> schedulers_;  // that the host has
  std::vector<PlantFinding> findings_;
  int round_ = 0;
  std::set<std::string> given_up_;  // instances
};

void HostWork::tell(Kind result, const WantedInstance* instance, std::string remark,
                    const PlantChange* change) {
  PlantFinding finding{.result = result,
                       .host = wanted_.name,
                       .instance = instance != nullptr ? instance->name : "",
                       .line = instance != nullptr ? instance->line : wanted_.line,
                       .what = "",
                       .is = "",
                       .wanted = "",
                       .remark = std::move(remark)};
  if (change != nullptr) {
    finding.what = change->what;
    finding.is = change->is;
    finding.wanted = change->wanted;
  }
  findings_.push_back(std::move(finding));
}

bool HostWork::enter(ParticipantSource& participant) {
  const auto connect = [&]() -> Result<std::unique_ptr<ControlClient>> {
    PLCHOST_TRY_ASSIGN(auto entered, participant.get());
    return ControlClient::connect(std::move(entered), wanted_.name);
  };
  auto connected = connect();
  if (!connected) {
    tell(Kind::unknown, nullptr, connected.error().describe());
    return false;
  }
  client_ = *std::move(connected);
  const auto view = client_->host(wanted_.name, MonotonicClock::now() + work_.patience);
  if (!view) {
    tell(Kind::missing, nullptr, view.error().describe());
    return false;
  }
  schedulers_ = view->schedulers();
  return selection_.selects(*view);
}

bool HostWork::has_schedulers() {
  bool has_all = true;
  for (const WantedInstance& instance : wanted_.instances) {
    const bool known = instance.scheduler.empty() || schedulers_.empty() ||
                       std::ranges::find(schedulers_, instance.scheduler) != schedulers_.end();
    if (known) continue;
    has_all = false;
    tell(Kind::refused, &instance,
         unknown_name("scheduler", instance.scheduler, schedulers_, wanted_.name).error().message);
  }
  return has_all;
}

std::vector<PlantFinding> HostWork::check(ParticipantSource& participant) {
  const bool names_any = std::ranges::any_of(
      wanted_.instances, [](const WantedInstance& instance) { return !instance.scheduler.empty(); });
  if (names_any && enter(participant)) (void)has_schedulers();
  return std::move(findings_);
}

std::vector<PlantFinding> HostWork::run(ParticipantSource& participant) {
  if (!enter(participant) || !has_schedulers()) return std::move(findings_);
  while (round_ <= kRounds && look_at_all()) ++round_;
  return std::move(findings_);
}

bool HostWork::look_at_all() {
  // It answers: its status comes, if not at once.
  const auto present = look_at(*client_, wanted_, MonotonicClock::now() + work_.command_patience);
  if (!present) {
    tell(Kind::unknown, nullptr, present.error().describe());
    return false;
  }
  bool changed = false;
  for (const WantedInstance& instance : wanted_.instances) {
    if (given_up_.contains(instance.name)) continue;
    const auto found = present->find(instance.name);
    if (found != present->end()) {
      changed |= look_at_one(instance, found->second);
      continue;
    }
    given_up_.insert(instance.name);
    std::vector<std::string> names;
    for (const auto& [name, unused] : *present) names.push_back(name);
    tell(Kind::unknown, &instance,
         unknown_name("instance", instance.name, names, wanted_.name).error().message);
  }
  return changed;
}

bool HostWork::look_at_one(const WantedInstance& wanted, const PresentInstance& present) {
  bool changed = false;
  for (const PlantChange& needed : changes_to(wanted, present)) {
    if (!work_.apply) {
      tell(Kind::differs, &wanted, "", &needed);
    } else if (round_ == kRounds) {
      tell(Kind::failed, &wanted, "all commands succeeded, and the difference is still there", &needed);
    } else if (change(wanted, needed)) {
      changed = true;
    } else {
      given_up_.insert(wanted.name);
      return false;  // the rest counts on it
    }
  }
  return changed;
}

bool HostWork::change(const WantedInstance& wanted, const PlantChange& change) {
  constexpr Duration kAskAgain = std::chrono::milliseconds(100);
  const TimePoint deadline = MonotonicClock::now() + work_.command_patience;
  for (;;) {
    const auto reply = client_->call({.host = wanted_.name,
                                      .operation = change.operation,
                                      .instance = wanted.name,
                                      .argument = change.argument},
                                     deadline);
    if (reply && reply->code == ErrorCode::busy && MonotonicClock::now() < deadline) {
      std::this_thread::sleep_for(kAskAgain);
      continue;
    }
    const bool done = reply && reply->code == ErrorCode::ok;
    tell(done ? Kind::done : Kind::failed, &wanted, reply ? reply->text : reply.error().describe(), &change);
    return done;
  }
}

/// Whether the host may be selected, as far as that can be known without it.
bool may_be_selected(const WantedHost& host, const HostSelection& selection) {
  HostSelection by_name = selection;
  by_name.labels.clear();
  HostView view;
  view.name = host.name;
  return by_name.selects(view);
}

}  // namespace

std::vector<PlantFinding> work_on(const Plant& plant, const HostSelection& selection,
                                  const dds::DomainOptions& options, const PlantWork& work) {
  constexpr std::size_t kAtOnce = 16;
  ParticipantSource participant(options);
  std::vector<const WantedHost*> hosts;
  for (const WantedHost& host : plant.hosts) {
    if (may_be_selected(host, selection)) hosts.push_back(&host);
  }
  std::vector<std::vector<PlantFinding>> found(hosts.size());
  const auto visit = [&](std::vector<PlantFinding> (HostWork::*step)(ParticipantSource&)) {
    std::atomic<std::size_t> next{0};
    const auto work_through = [&] {
      for (std::size_t i = next++; i < hosts.size(); i = next++) {
        if (found[i].empty()) found[i] = (HostWork(*hosts[i], selection, work).*step)(participant);
      }
    };
    // Threads: the changes of a host follow each other, and each call of HostWork waits for its answer.
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < std::min(kAtOnce, hosts.size()); ++i) threads.emplace_back(work_through);
  };
  const auto is_refused = [](const std::vector<PlantFinding>& findings) {
    return std::ranges::find(findings, Kind::refused, &PlantFinding::result) != findings.end();
  };
  if (work.apply) visit(&HostWork::check);
  if (std::ranges::none_of(found, is_refused)) visit(&HostWork::run);
  std::vector<PlantFinding> all;
  for (auto& of_host : found) std::ranges::move(of_host, std::back_inserter(all));
  return all;
}

}  // namespace plchost
