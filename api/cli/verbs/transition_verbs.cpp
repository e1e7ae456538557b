#include "api/cli/verbs/transition_verbs.hpp"

#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/output.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

struct TransitionArguments {
  std::string instance;
  std::uint64_t count = 0;  // watch: 0 is until Ctrl-C
};

/// Of which hosts and instance.
struct Wanted {
  std::vector<HostView> hosts;
  bool of_others = false;  // of hosts that come later, too
  std::string instance;

  [[nodiscard]] bool operator()(const plc_Transition& transition) const {
    const auto is_it = [&](const HostView& host) { return dds::text_of(transition.host) == host.name; };
    return (instance.empty() || dds::text_of(transition.instance) == instance) &&
           (of_others || std::ranges::any_of(hosts, is_it));
  }
};

Result<Wanted> wanted(CliSession& session, const TransitionArguments& arguments) {
  PLCHOST_TRY_ASSIGN(auto hosts, session.shown_hosts());
  const HostSelection& selection = session.options.hosts;
  return Wanted{.hosts = std::move(hosts),
                .of_others = selection.host.empty() && selection.labels.empty(),
                .instance = arguments.instance};
}

// DDS itself cannot tell: Cyclone's dds_reader_wait_for_historical_data() waits for nothing.
Result<bool> has_all(ControlClient& client, const std::vector<HostView>& hosts, TimePoint deadline) {
  for (const HostView& host : hosts) {
    const auto complete = client.has_all_transitions(host.name, deadline);
    if (!complete || !*complete) return complete;
  }
  return true;
}

// All that the hosts have told of, and what came meanwhile.
Result<std::vector<plc_Transition>> collect(CliSession& session, const TransitionArguments& arguments) {
  PLCHOST_TRY_ASSIGN(const auto is_wanted, wanted(session, arguments));
  ControlClient& client = *session.client().value();
  const TimePoint deadline = session.deadline();
  std::vector<plc_Transition> found;
  for (;;) {
    PLCHOST_TRY_ASSIGN(const auto complete, has_all(client, is_wanted.hosts, deadline));
    if (complete) return found;
    if (MonotonicClock::now() >= deadline) {
      return failure(ErrorCode::timed_out, "the changes of state have not come completely");
    }
    PLCHOST_TRY_ASSIGN(const auto news, client.transitions());
    for (const TransitionView& view : news) {
      if (is_wanted(view.sample)) found.push_back(view.sample);
    }
    if (news.empty()) client.wait_for_change(deadline);
  }
}

int list_transitions(CliSession& session, const TransitionArguments& arguments) {
  const auto rows = transition_rows(session, arguments.instance);
  if (!rows) return CliSession::fail(rows.error());
  if (rows->empty() && !arguments.instance.empty()) {
    if (const auto known = session.check_instance(arguments.instance); !known)
      return CliSession::fail(known.error());
  }
  return session.show(*rows, columns_of<plc_Transition>());
}

void print(const CliSession& session, const TransitionView& view) {
  const Row row = to_row(view.sample);
  if (session.options.json) {
    fmt::print("{}\n", json_text(row));
    return;
  }
  if (view.missed > 0) fmt::print("({} were overtaken and are not shown)\n", view.missed);
  const auto text = [&row](const char* field) { return printable(row[field].get<std::string>()); };
  fmt::print("{}  {}/{}  {}  {} -> {}  {}\n", text("time"), text("host"), text("instance"), text("of"),
             text("from"), text("to"), text("reason"));
}

int watch_transitions(CliSession& session, const TransitionArguments& arguments) {
  catch_interrupts();
  const auto is_wanted = wanted(session, arguments);
  if (!is_wanted) return CliSession::fail(is_wanted.error());
  if (!arguments.instance.empty()) {
    if (const auto known = session.check_instance(arguments.instance); !known)
      return CliSession::fail(known.error());
  }
  ControlClient& client = *session.client().value();
  std::uint64_t shown = 0;
  while (!interrupted()) {
    const auto news = client.transitions();
    if (!news) return CliSession::fail(news.error());
    for (const TransitionView& view : *news) {
      if (!(*is_wanted)(view.sample)) continue;
      print(session, view);
      flush_output();
      if (++shown == arguments.count) return kExitDone;
    }
    client.wait_for_change(MonotonicClock::now() + kInterruptLook);
  }
  return kExitDone;
}

}  // namespace

Result<std::vector<Row>> transition_rows(CliSession& session, const std::string& instance) {
  PLCHOST_TRY_ASSIGN(auto found, collect(session, {.instance = instance}));
  std::ranges::stable_sort(found, {}, [](const plc_Transition& sample) { return sample.time_unix_ns; });
  std::vector<Row> rows;
  for (const plc_Transition& sample : found) rows.push_back(to_row(sample));
  return rows;
}

void add_list_transitions(const Command& verb, CliSession& session) {
  const auto arguments = std::make_shared<TransitionArguments>();
  verb.noun("transitions", "The last changes of state of the instances",
            [&session, arguments] { return list_transitions(session, *arguments); })
      .optional("INSTANCE", arguments->instance, "only of this instance");
}

void add_watch_transitions(const Command& verb, CliSession& session) {
  const auto arguments = std::make_shared<TransitionArguments>();
  verb.noun("transitions", "Each change of state, one line (with --json one object) each, until Ctrl-C",
            [&session, arguments] { return watch_transitions(session, *arguments); })
      .optional("INSTANCE", arguments->instance, "only of this instance")
      .option("--count", arguments->count, "end after so many", std::uint64_t{0}, kMaxCount);
}

}  // namespace plchost
