#include "api/cli/verbs/host_commands.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

bool takes_long(std::int32_t operation) {
  switch (operation) {
    case plc_OPERATION_STOP:
    case plc_OPERATION_SINGLE_CYCLE:
    case plc_OPERATION_RESET:
    case plc_OPERATION_RESET_COLD:
    case plc_OPERATION_RESTART:
    case plc_OPERATION_LOAD_APPLICATION:
    case plc_OPERATION_ROLLBACK_APPLICATION:
      return true;
    default:
      return false;
  }
}

// What a refusal does not say itself: the instance that was meant.
std::string advice(CliSession& session, const HostOutcome& outcome, const std::string& instance) {
  if (outcome.reply->code != ErrorCode::not_found) return "";
  std::vector<std::string> names;
  if (const auto all = session.client().value()->instances(outcome.host, session.deadline())) {
    for (const auto& known : *all) names.emplace_back(dds::text_of(known.instance));
  }
  return hint(instance, names);
}

/// Says what became of it at one of `count` hosts; its exit code.
int tell(CliSession& session, const HostOutcome& outcome, const std::string& instance, std::size_t count) {
  const std::string where = count > 1 ? outcome.host + ": " : "";
  if (!outcome.reply) {
    Error error = outcome.reply.error();
    error.message = where + error.message;
    return CliSession::fail(error);
  }
  if (outcome.reply->code != ErrorCode::ok) {
    const std::string said = where + outcome.reply->text + advice(session, outcome, instance);
    fmt::print(stderr, "plcctl: {}\n", printable(said));
    return kExitFailed;
  }
  if (session.options.json || session.options.csv) return kExitDone;
  if (count > 1 || !outcome.reply->text.empty()) {
    fmt::print("{}\n", printable(where + (outcome.reply->text.empty() ? "done" : outcome.reply->text)));
  }
  return kExitDone;
}

Row row_of(const HostOutcome& outcome, const std::string& instance) {
  const bool done = outcome.reply && outcome.reply->code == ErrorCode::ok;
  return {{"host", outcome.host},
          {"instance", instance},
          {"done", done},
          {"remark", outcome.reply ? outcome.reply->text : outcome.reply.error().describe()}};
}

}  // namespace

int command(CliSession& session, const ApiRequest& request) {
  const auto hosts = session.target_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  const TimePoint deadline =
      session.deadline(takes_long(request.operation) ? kLongCommand : Duration::zero());
  return ask_hosts(session, *hosts, request.instance, [&](ControlClient& client, const std::string& host) {
    ApiRequest own = request;
    own.host = host;
    return client.call(own, deadline);
  });
}

int ask_hosts(CliSession& session, const std::vector<std::string>& hosts, const std::string& instance,
              const HostCall& call) {
  std::vector<HostOutcome> outcomes;
  if (hosts.size() == 1) {  // over the connection that is there
    outcomes.push_back({.host = hosts.front(), .reply = call(*session.client().value(), hosts.front())});
  } else {
    outcomes = ask_each(session.options.dds, hosts, call);
  }
  int code = kExitDone;
  std::vector<Row> done;
  for (const HostOutcome& outcome : outcomes) {
    code = std::max(code, tell(session, outcome, instance, outcomes.size()));
    if (outcomes.size() > 1 || code == kExitDone) done.push_back(row_of(outcome, instance));
  }
  if ((session.options.json || session.options.csv) && !done.empty()) session.show(done, {});
  return code;
}

}  // namespace plchost
