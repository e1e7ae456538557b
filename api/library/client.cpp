// The calls of a Client, but for commands.
#include <utility>

#include "api/client/control_client_status.hpp"
#include "api/client/log_reader.hpp"
#include "api/library/calls.hpp"
#include "api/library/convert.hpp"
#include "api/library/records.hpp"
#include "api/library/watcher.hpp"
#include "api/library/worker.hpp"

namespace plchost {

namespace {

/// All samples of a status topic, as the library's type of them.
template <class Sample>
auto list(ControlClient& client, const std::string& name, TimePoint deadline)
    -> Result<std::vector<decltype(to_public(Sample{}))>> {
  PLCHOST_TRY_ASSIGN(const auto host, host_of(client, name, deadline));
  PLCHOST_TRY_ASSIGN(const auto samples, client.status<Sample>(host, deadline));
  std::vector<decltype(to_public(Sample{}))> items;
  for (const Sample& sample : samples) items.push_back(to_public(sample));
  return items;
}

template <class Sample, class Worker>
auto list_or_throw(Worker& worker, const std::string& host) {
  using Items = std::vector<decltype(to_public(Sample{}))>;
  return value_or_throw(worker.template run<Items>(
      [&](ControlClient& client) { return list<Sample>(client, host, worker.deadline()); }));
}

Result<std::vector<Client::LogLine>> read_lines(ControlClient& client, const std::string& name,
                                                const std::string& instance, LogPlace place,
                                                std::uint64_t newest, TimePoint deadline) {
  PLCHOST_TRY_ASSIGN(const auto host, host_of(client, name, deadline));
  LogReader log(host, instance, place);
  PLCHOST_TRY_ASSIGN(const auto said, log.read(client, deadline, newest));
  std::vector<Client::LogLine> lines;
  for (const LogText& text : said) {
    lines.push_back(to_public(text));
    lines.back().host = host;
    lines.back().instance = instance;
    lines.back().stream = log.place().stream;
  }
  return lines;
}

Result<PostReport> post_to(ControlClient& client, const std::string& name, const std::string& event,
                           std::uint64_t count, Duration timeout) {
  PLCHOST_TRY_ASSIGN(auto id, event_of(event));
  PLCHOST_TRY_ASSIGN(const auto host, host_of(client, name, MonotonicClock::now() + timeout));
  return client.post_event({host, std::move(id.instance), std::move(id.event)}, count, Duration{}, timeout);
}

Client::Outcome outcome_of(const Result<PostReport>& report) {
  if (report) return to_public(*report);
  return {.code = static_cast<int>(report.error().code), .text = report.error().describe(), .posted = {}};
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
  watcher_ = std::make_unique<Watcher>(participant, options.host);
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
  return list_or_throw<plc_InstanceStatus>(*worker_, host);
}

std::vector<Client::Task> Client::tasks(const std::string& host) {
  return list_or_throw<plc_TaskStatus>(*worker_, host);
}

std::vector<Client::Event> Client::events(const std::string& host) {
  return list_or_throw<plc_EventStatus>(*worker_, host);
}

std::vector<Client::Application> Client::applications(const std::string& host) {
  return list_or_throw<plc_ApplicationStatus>(*worker_, host);
}

std::vector<Client::Exception> Client::exceptions(const std::string& host) {
  return list_or_throw<plc_ExceptionStatus>(*worker_, host);
}

std::vector<Client::Writer> Client::writers(const std::string& host) {
  return list_or_throw<plc_WriterStatus>(*worker_, host);
}

Client::TaskStatistics Client::statistics(const std::string& host, const std::string& instance,
                                          const std::string& task) {
  return value_or_throw(worker_->run<TaskStatistics>([&](ControlClient& client) -> Result<TaskStatistics> {
    const TimePoint deadline = worker_->deadline();
    PLCHOST_TRY_ASSIGN(const auto found, host_of(client, host, deadline));
    PLCHOST_TRY_ASSIGN(const auto report, client.statistics(found, instance, task, deadline));
    return to_public(report);
  }));
}

std::vector<std::string> Client::topics() {
  return status_names();
}

std::vector<Client::Record> Client::status(const std::string& topic, const std::string& host) {
  return value_or_throw(
      worker_->run<std::vector<Record>>([&](ControlClient& client) -> Result<std::vector<Record>> {
        PLCHOST_TRY_ASSIGN(const auto found, host_of(client, host, worker_->deadline()));
        return read_status(client, topic, found, worker_->deadline());
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
        PLCHOST_TRY_ASSIGN(const auto found, host_of(client, host, worker_->deadline()));
        return client.post_batch(found, ids, worker_->timeout());
      })));
}

Client::Run Client::post_and_wait(const std::string& host, const std::string& event) {
  auto id = value_or_throw(event_of(event));
  const auto run = value_or_throw(worker_->run<RunReport>([&](ControlClient& client) -> Result<RunReport> {
    PLCHOST_TRY_ASSIGN(const auto found, host_of(client, host, worker_->deadline()));
    return client.post_and_await({found, id.instance, id.event}, worker_->timeout());
  }));
  return {.tasks = run.tasks,
          .last_task = run.last_task,
          .to_start = run.to_start,
          .to_end = run.to_end,
          .round_trip = run.round_trip};
}

}  // namespace plchost
