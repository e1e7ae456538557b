#include "api/cli/plant/plant_work.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "api/cli/at_once.hpp"
#include "api/cli/cli_session.hpp"
#include "api/cli/plant/plant_changes.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

using Kind = PlantFinding::Result;
using Instances = std::map<std::string, PresentInstance>;

// Some changes show only when others are done. In the round after the last one nothing may be left.
constexpr int kRounds = 3;

Async<Result<Instances>> look_at(ClientCore& core, const WantedHost& wanted, TimePoint deadline) {
  Instances present;
  PLCHOST_CO_TRY_ASSIGN(const auto instances,
                        co_await core.status<plc_InstanceStatus>(wanted.name, deadline));
  for (const plc_InstanceStatus& status : instances) {
    present[std::string(dds::text_of(status.instance))] = {
        .state = status.state,
        .scheduler = std::string(dds::text_of(status.scheduler)),
        .application = std::string(dds::text_of(status.application)),
        .events = {}};
  }
  const bool events_count = std::ranges::any_of(
      wanted.instances, [](const WantedInstance& instance) { return !instance.events.empty(); });
  if (!events_count) co_return present;
  PLCHOST_CO_TRY_ASSIGN(const auto events, co_await core.status<plc_EventStatus>(wanted.name, deadline));
  for (const plc_EventStatus& event : events) {
    const auto found = present.find(std::string(dds::text_of(event.instance)));
    if (event.registered && found != present.end()) found->second.events.emplace(dds::text_of(event.event));
  }
  co_return present;
}

/// Brings one host to what it is to be. Its steps follow each other, those of other hosts go on meanwhile.
class HostWork {
 public:
  HostWork(ClientCore& core, const WantedHost& wanted, const HostSelection& selection, const PlantWork& work)
      : core_(core), wanted_(wanted), selection_(selection), work_(work) {}

  Async<bool> run();
  /// Changes nothing: only finds what the host must have, and has not.
  Async<bool> check();
  [[nodiscard]] const std::vector<PlantFinding>& findings() const noexcept { return findings_; }

 private:
  /// Whether it answers, and is selected.
  Async<bool> enter();
  /// Whether the host has all schedulers that the file names. A host of an older version does not say.
  bool has_schedulers();
  /// Whether something was changed, so that it is worth to look again.
  Async<bool> look_at_all();
  Async<bool> look_at_one(const WantedInstance& wanted, const PresentInstance& present);
  Async<bool> change(const WantedInstance& wanted, const PlantChange& change);
  void tell(Kind result, const WantedInstance* instance, std::string remark,
            const PlantChange* change = nullptr);

  ClientCore& core_;
  const WantedHost& wanted_;
  const HostSelection& selection_;
  const PlantWork& work_;
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

Async<bool> HostWork::enter() {
  const auto view = co_await core_.host(wanted_.name, MonotonicClock::now() + work_.patience);
  if (!view) {
    tell(Kind::missing, nullptr, view.error().describe());
    co_return false;
  }
  schedulers_ = view->schedulers();
  co_return selection_.selects(*view);
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

Async<bool> HostWork::check() {
  const bool names_any = std::ranges::any_of(
      wanted_.instances, [](const WantedInstance& instance) { return !instance.scheduler.empty(); });
  if (!names_any) co_return true;
  const bool entered = co_await enter();
  co_return entered&& has_schedulers();
}

Async<bool> HostWork::run() {
  if (!findings_.empty()) co_return false;
  const bool entered = co_await enter();
  if (!entered || !has_schedulers()) co_return false;
  for (bool changed = true; changed && round_ <= kRounds; ++round_) changed = co_await look_at_all();
  co_return true;
}

Async<bool> HostWork::look_at_all() {
  // It answers: its status comes, if not at once.
  const auto present = co_await look_at(core_, wanted_, MonotonicClock::now() + work_.command_patience);
  if (!present) {
    tell(Kind::unknown, nullptr, present.error().describe());
    co_return false;
  }
  bool changed = false;
  for (const WantedInstance& instance : wanted_.instances) {
    if (given_up_.contains(instance.name)) continue;
    const auto found = present->find(instance.name);
    if (found != present->end()) {
      const bool now_changed = co_await look_at_one(instance, found->second);
      changed = changed || now_changed;
      continue;
    }
    given_up_.insert(instance.name);
    std::vector<std::string> names;
    for (const auto& [name, unused] : *present) names.push_back(name);
    tell(Kind::unknown, &instance,
         unknown_name("instance", instance.name, names, wanted_.name).error().message);
  }
  co_return changed;
}

Async<bool> HostWork::look_at_one(const WantedInstance& wanted, const PresentInstance& present) {
  const auto all_needed = changes_to(wanted, present);
  bool changed = false;
  for (const PlantChange& needed : all_needed) {
    if (!work_.apply) {
      tell(Kind::differs, &wanted, "", &needed);
      continue;
    }
    if (round_ == kRounds) {
      tell(Kind::failed, &wanted, "all commands succeeded, and the difference is still there", &needed);
      continue;
    }
    const bool done = co_await change(wanted, needed);
    if (!done) {
      given_up_.insert(wanted.name);
      co_return false;  // the rest counts on it
    }
    changed = true;
  }
  co_return changed;
}

Async<bool> HostWork::change(const WantedInstance& wanted, const PlantChange& change) {
  constexpr Duration kAskAgain = std::chrono::milliseconds(100);
  const ApiRequest request{.host = wanted_.name,
                           .operation = change.operation,
                           .instance = wanted.name,
                           .argument = change.argument};
  const TimePoint deadline = MonotonicClock::now() + work_.command_patience;
  for (;;) {
    const auto reply = co_await core_.call(request, deadline);
    if (reply && reply->code == ErrorCode::busy && MonotonicClock::now() < deadline) {
      const TimePoint again = MonotonicClock::now() + kAskAgain;
      while (MonotonicClock::now() < again) co_await core_.pump().change(again);
      continue;
    }
    const bool done = reply && reply->code == ErrorCode::ok;
    tell(done ? Kind::done : Kind::failed, &wanted, reply ? reply->text : reply.error().describe(), &change);
    co_return done;
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

std::vector<PlantFinding> work_on(ControlClient& client, const Plant& plant, const HostSelection& selection,
                                  const PlantWork& work) {
  std::vector<HostWork> hosts;
  for (const WantedHost& host : plant.hosts) {
    if (may_be_selected(host, selection)) hosts.emplace_back(client.core(), host, selection, work);
  }
  const auto visit = [&](Async<bool> (HostWork::*step)()) {
    (void)client.wait(
        all_at_once(client.core().pump(), hosts.size(), [&](std::size_t i) { return (hosts[i].*step)(); }));
  };
  const auto is_refused = [](const HostWork& host) {
    return std::ranges::find(host.findings(), Kind::refused, &PlantFinding::result) != host.findings().end();
  };
  if (work.apply) visit(&HostWork::check);
  if (std::ranges::none_of(hosts, is_refused)) visit(&HostWork::run);
  std::vector<PlantFinding> all;
  for (const HostWork& host : hosts) std::ranges::copy(host.findings(), std::back_inserter(all));
  return all;
}

}  // namespace plchost
