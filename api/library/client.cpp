// The calls of a Client.
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client_status.hpp"
#include "api/client/log_reader.hpp"
#include "api/library/convert.hpp"
#include "api/library/records.hpp"
#include "api/library/watcher.hpp"
#include "api/library/worker.hpp"
#include "shm/base/names.hpp"
#include "shm/base/operations.hpp"

namespace plchost {

namespace {

template <class T>
T value_or_throw(Result<T> result) {
  if (!result) throw_client_error(result.error());
  return *std::move(result);
}

Result<EventId> event_of(const std::string& name) {
  auto parts = split_name("EVENT", name);
  if (!parts) return std::unexpected(std::move(parts).error());
  return EventId{std::move(parts->first), std::move(parts->second)};
}

/// That host, once it answers; no name: the only one.
Result<std::string> host_of(ControlClient& client, const std::string& name, TimePoint deadline) {
  if (!name.empty()) {
    auto found = client.host(name, deadline);
    if (!found) return std::unexpected(std::move(found).error());
    return std::move(found->name);
  }
  const auto all = client.hosts(deadline);
  if (all.size() == 1) return all.front().name;
  if (all.empty()) return failure(ErrorCode::unavailable, "no host answers");
  std::vector<std::string_view> names;
  for (const HostView& host : all) names.emplace_back(host.name);
  return failure(ErrorCode::invalid_argument,
                 fmt::format("several hosts answer, and none was named: {}", join_names(names)));
}

/// All samples of a status topic, as the library's type of them.
template <class Sample>
auto list(ControlClient& client, const std::string& name, TimePoint deadline)
    -> Result<std::vector<decltype(to_public(Sample{}))>> {
  const auto host = host_of(client, name, deadline);
  if (!host) return std::unexpected(host.error());
  const auto samples = client.status<Sample>(*host, deadline);
  if (!samples) return std::unexpected(samples.error());
  std::vector<decltype(to_public(Sample{}))> items;
  for (const Sample& sample : *samples) items.push_back(to_public(sample));
  return items;
}

Result<std::vector<Client::LogLine>> read_lines(ControlClient& client, const std::string& name,
                                                const std::string& instance, LogPlace place,
                                                std::uint64_t newest, TimePoint deadline) {
  auto host = host_of(client, name, deadline);
  if (!host) return std::unexpected(std::move(host).error());
  LogReader log(*host, instance, place);
  const auto said = log.read(client, deadline, newest);
  if (!said) return std::unexpected(said.error());
  std::vector<Client::LogLine> lines;
  for (const LogText& text : *said) {
    lines.push_back(to_public(text));
    lines.back().host = *host;
    lines.back().instance = instance;
    lines.back().stream = log.place().stream;
  }
  return lines;
}

Result<PostReport> post_to(ControlClient& client, const std::string& name, const std::string& event,
                           std::uint64_t count, Duration timeout) {
  auto id = event_of(event);
  if (!id) return std::unexpected(std::move(id).error());
  const auto host = host_of(client, name, MonotonicClock::now() + timeout);
  if (!host) return std::unexpected(host.error());
  return client.post_event({*host, 0, std::move(id->instance), std::move(id->event)}, count, Duration{},
                           timeout);
}

Client::Outcome outcome_of(const Result<PostReport>& report) {
  if (report) return to_public(*report);
  return {.code = static_cast<int>(report.error().code), .text = report.error().describe(), .posted = {}};
}

Client::Outcome outcome_of(const Result<ApiReply>& reply) {
  if (!reply)
    return {.code = static_cast<int>(reply.error().code), .text = reply.error().describe(), .posted = {}};
  return {.code = static_cast<int>(reply->code), .text = reply->text, .posted = {}};
}

// The answers of others come as pages, and a download has contents.
bool is_command(const Operation& known) {
  return known.place != OperationPlace::internal && !known.only_reads &&
         known.options != OperationOptions::download;
}

std::string_view argument_name(OperationArgument argument) {
  switch (argument) {
    case OperationArgument::none:
      return "";
    case OperationArgument::path:
      return "path";
    case OperationArgument::file:
      return "file";
    case OperationArgument::scheduler:
      return "scheduler";
    case OperationArgument::event:
      return "event";
    case OperationArgument::task_or_none:
      return "task";
  }
  return "";
}

Result<std::int32_t> number_of(const std::string& name) {
  const Operation* const known = find_operation(name);
  if (known != nullptr && is_command(*known)) return static_cast<std::int32_t>(known->verb);
  std::vector<std::string_view> names;
  for (const Operation& operation : operations()) {
    if (is_command(operation)) names.push_back(operation.name);
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("no command '{}'; there are: {}", shown(name), join_names(names)));
}

/// `request.host`: empty: the only one.
Result<ApiReply> call(ControlClient& client, ApiRequest request, TimePoint deadline) {
  auto found = host_of(client, request.host, deadline);
  if (!found) return std::unexpected(std::move(found).error());
  request.host = *std::move(found);
  return client.call(request, deadline);
}

Client::Posted posted_or_throw(const Client::Outcome& outcome) {
  if (!outcome) throw ClientError(outcome.code, outcome.text);
  return outcome.posted;
}

}  // namespace

ClientError::~ClientError() = default;

Client::Client() : Client(Options{}) {}
Client::Client(const Options& options) {
  const auto participant = std::make_shared<ParticipantSource>(domain_options(options));
  worker_ = std::make_unique<Worker>(options, participant);
  watcher_ = std::make_unique<Watcher>(participant);
}
Client::~Client() {
  if (worker_->maker().is_this()) return;
  (void)worker_.release();
  (void)watcher_.release();
}

void Client::close() {
  if (!worker_->maker().is_this()) return;
  watcher_->end();
  worker_->end();
}

std::vector<Client::Host> Client::hosts() {
  return value_or_throw(worker_->run<std::vector<Host>>([this](ControlClient& client) {
    std::vector<Host> hosts;
    for (const HostView& view : client.hosts(worker_->deadline())) {
      hosts.push_back(to_public(view, !client.is_silent(view.name)));
    }
    return Result<std::vector<Host>>(std::move(hosts));
  }));
}

std::vector<Client::Instance> Client::instances(const std::string& host) {
  return value_or_throw(worker_->run<std::vector<Instance>>(
      [&](ControlClient& client) { return list<plc_InstanceStatus>(client, host, worker_->deadline()); }));
}

std::vector<Client::Task> Client::tasks(const std::string& host) {
  return value_or_throw(worker_->run<std::vector<Task>>(
      [&](ControlClient& client) { return list<plc_TaskStatus>(client, host, worker_->deadline()); }));
}

std::vector<Client::Event> Client::events(const std::string& host) {
  return value_or_throw(worker_->run<std::vector<Event>>(
      [&](ControlClient& client) { return list<plc_EventStatus>(client, host, worker_->deadline()); }));
}

std::vector<Client::Application> Client::applications(const std::string& host) {
  return value_or_throw(worker_->run<std::vector<Application>>(
      [&](ControlClient& client) { return list<plc_ApplicationStatus>(client, host, worker_->deadline()); }));
}

std::vector<Client::Exception> Client::exceptions(const std::string& host) {
  return value_or_throw(worker_->run<std::vector<Exception>>(
      [&](ControlClient& client) { return list<plc_ExceptionStatus>(client, host, worker_->deadline()); }));
}

std::vector<Client::Writer> Client::writers(const std::string& host) {
  return value_or_throw(worker_->run<std::vector<Writer>>(
      [&](ControlClient& client) { return list<plc_WriterStatus>(client, host, worker_->deadline()); }));
}

Client::TaskStatistics Client::statistics(const std::string& host, const std::string& instance,
                                          const std::string& task) {
  return value_or_throw(worker_->run<TaskStatistics>([&](ControlClient& client) -> Result<TaskStatistics> {
    const TimePoint deadline = worker_->deadline();
    const auto found = host_of(client, host, deadline);
    if (!found) return std::unexpected(found.error());
    const auto report = client.statistics(*found, instance, task, deadline);
    if (!report) return std::unexpected(report.error());
    return to_public(*report);
  }));
}

std::vector<std::string> Client::topics() {
  return status_names();
}

std::vector<Client::Record> Client::status(const std::string& topic, const std::string& host) {
  return value_or_throw(
      worker_->run<std::vector<Record>>([&](ControlClient& client) -> Result<std::vector<Record>> {
        const auto found = host_of(client, host, worker_->deadline());
        if (!found) return std::unexpected(found.error());
        return read_status(client, topic, *found, worker_->deadline());
      }));
}

std::vector<Client::LogLine> Client::logs(const std::string& host, const std::string& instance,
                                          unsigned long long newest) {
  return value_or_throw(worker_->run<std::vector<LogLine>>([&](ControlClient& client) {
    return read_lines(client, host, instance, {}, newest, worker_->deadline());
  }));
}

std::vector<Client::LogLine> Client::logs(const std::string& host, const std::string& instance,
                                          const LogLine& after) {
  return value_or_throw(worker_->run<std::vector<LogLine>>([&](ControlClient& client) {
    const LogPlace place{.stream = after.stream, .after = after.number};
    return read_lines(client, host, instance, place, kLogRecordsKept, worker_->deadline());
  }));
}

Client::Posted Client::post(const std::string& host, const std::string& event, unsigned long long count) {
  return posted_or_throw(outcome_of(worker_->run<PostReport>(
      [&](ControlClient& client) { return post_to(client, host, event, count, worker_->timeout()); })));
}

void Client::post(const std::string& host, const std::string& event,
                  std::function<void(const Outcome&)> done) {
  check_callback(static_cast<bool>(done));
  worker_->begin([this, host, event, done = std::move(done)](const Result<ControlClient*>& client) {
    done(outcome_of(client ? post_to(**client, host, event, 1, worker_->timeout())
                           : Result<PostReport>(std::unexpected(client.error()))));
  });
}

Client::Posted Client::post_all(const std::string& host, const std::vector<std::string>& events) {
  std::vector<EventId> ids;
  for (const std::string& event : events) ids.push_back(value_or_throw(event_of(event)));
  return posted_or_throw(
      outcome_of(worker_->run<PostReport>([&](ControlClient& client) -> Result<PostReport> {
        const auto found = host_of(client, host, worker_->deadline());
        if (!found) return std::unexpected(found.error());
        return client.post_batch(*found, ids, worker_->timeout());
      })));
}

Client::Run Client::post_and_wait(const std::string& host, const std::string& event) {
  auto id = value_or_throw(event_of(event));
  const auto run = value_or_throw(worker_->run<RunReport>([&](ControlClient& client) -> Result<RunReport> {
    const auto found = host_of(client, host, worker_->deadline());
    if (!found) return std::unexpected(found.error());
    return client.post_and_await({*found, 0, id.instance, id.event}, worker_->timeout());
  }));
  return {.tasks = run.tasks,
          .last_task = run.last_task,
          .to_start = run.to_start,
          .to_end = run.to_end,
          .round_trip = run.round_trip};
}

std::vector<Client::Operation> Client::operations() {
  std::vector<Operation> all;
  for (const plchost::Operation& known : plchost::operations()) {
    if (!is_command(known)) continue;
    all.push_back({.name = std::string(known.name),
                   .argument = std::string(argument_name(known.argument)),
                   .help = known.help,
                   .names_instance = known.names_instance,
                   .engineering = known.role == ApiRole::engineering});
  }
  return all;
}

std::string Client::command(const std::string& operation, const std::string& host,
                            const std::string& instance, const std::string& argument) {
  const std::int32_t number = value_or_throw(number_of(operation));
  const auto reply = value_or_throw(worker_->run<ApiReply>([&](ControlClient& client) {
    return call(client, {host, number, instance, argument}, worker_->deadline());
  }));
  if (reply.code != ErrorCode::ok) throw ClientError(static_cast<int>(reply.code), reply.text);
  return reply.text;
}

void Client::command(const std::string& operation, const std::string& host, const std::string& instance,
                     const std::string& argument, std::function<void(const Outcome&)> done) {
  check_callback(static_cast<bool>(done));
  const std::int32_t number = value_or_throw(number_of(operation));
  worker_->begin([this, request = ApiRequest{host, number, instance, argument},
                  done = std::move(done)](const Result<ControlClient*>& client) {
    done(outcome_of(client ? call(**client, request, worker_->deadline())
                           : Result<ApiReply>(std::unexpected(client.error()))));
  });
}

std::string Client::start(const std::string& host, const std::string& instance) {
  return command("start", host, instance);
}

std::string Client::stop(const std::string& host, const std::string& instance) {
  return command("stop", host, instance);
}

std::string Client::restart(const std::string& host, const std::string& instance) {
  return command("restart", host, instance);
}

std::string Client::reset(const std::string& host, const std::string& instance, bool cold) {
  return command(cold ? "reset cold" : "reset", host, instance);
}

std::string Client::single_cycle(const std::string& host, const std::string& instance) {
  return command("single cycle", host, instance);
}

std::string Client::load_application(const std::string& host, const std::string& instance,
                                     const std::string& path) {
  return command("load application", host, instance, path);
}

std::string Client::set_scheduler(const std::string& host, const std::string& instance,
                                  const std::string& scheduler) {
  return command("set scheduler", host, instance, scheduler);
}

std::string Client::register_event(const std::string& host, const std::string& event) {
  const auto id = value_or_throw(event_of(event));
  return command("register event", host, id.instance, id.event);
}

std::string Client::unregister_event(const std::string& host, const std::string& event) {
  const auto id = value_or_throw(event_of(event));
  return command("unregister event", host, id.instance, id.event);
}

std::string Client::reload(const std::string& host) {
  return command("reload host", host);
}

}  // namespace plchost
