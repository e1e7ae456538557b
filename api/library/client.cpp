// The calls of a Client, but for commands.
#include <utility>

#include "api/client/client_core_status.hpp"
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
auto list(CallOrder& order, ClientCore& core, std::string host)
    -> Async<Result<std::vector<decltype(to_public(Sample{}))>>> {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  PLCHOST_CO_TRY_ASSIGN(const auto samples, co_await core.status<Sample>(place.host, place.deadline));
  std::vector<decltype(to_public(Sample{}))> items;
  for (const Sample& sample : samples) items.push_back(to_public(sample));
  co_return items;
}

template <class Sample, class Worker>
auto list_or_throw(Worker& worker, const std::string& host) {
  using Items = std::vector<decltype(to_public(Sample{}))>;
  return value_or_throw(
      worker.template run<Items>([&](ClientCore& core) { return list<Sample>(worker.order(), core, host); }));
}

Async<Result<std::vector<Client::Host>>> list_hosts(CallOrder& order, ClientCore& core) {
  std::vector<Client::Host> hosts;
  const auto found = co_await core.hosts(order.deadline());
  for (const HostView& view : found) hosts.push_back(to_public(view, !core.is_silent(view.name)));
  co_return hosts;
}

Async<Result<Client::TaskStatistics>> read_statistics(CallOrder& order, ClientCore& core, std::string host,
                                                      std::string instance, std::string task) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  PLCHOST_CO_TRY_ASSIGN(const auto report,
                        co_await core.statistics(place.host, instance, task, place.deadline));
  co_return to_public(report.sample());
}

Async<Result<std::vector<Client::Record>>> read_topic(CallOrder& order, ClientCore& core, std::string topic,
                                                      std::string host) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  co_return co_await read_status(core, topic, place.host, place.deadline);
}

Async<Result<std::vector<Client::LogLine>>> read_lines(CallOrder& order, ClientCore& core, std::string host,
                                                       std::string instance, LogPlace from,
                                                       std::uint64_t newest) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  LogReader log(place.host, instance, from);
  PLCHOST_CO_TRY_ASSIGN(const auto said, co_await log.read(core, place.deadline, newest));
  std::vector<Client::LogLine> lines;
  for (const LogText& text : said) {
    lines.push_back(to_public(text));
    lines.back().host = place.host;
    lines.back().instance = instance;
    lines.back().stream = log.place().stream;
  }
  co_return lines;
}

Async<Result<PostReport>> post_to(CallOrder& order, ClientCore& core, std::string host, std::string event,
                                  std::uint64_t count) {
  PLCHOST_CO_TRY_ASSIGN(auto id, event_of(event));
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  const HostEvent to{place.host, std::move(id.instance), std::move(id.event)};
  co_return co_await core.post_event(to, count, Duration{}, order.timeout());
}

Async<Result<PostReport>> post_batch(CallOrder& order, ClientCore& core, std::string host,
                                     std::vector<EventId> events) {
  PLCHOST_CO_TRY_ASSIGN(const auto place, co_await order.place(core, host));
  co_return co_await core.post_batch(place.host, events, order.timeout());
}

Async<Result<RunReport>> post_and_await(CallOrder& order, ClientCore& core, std::string host, EventId id) {
  PLCHOST_CO_TRY_ASSIGN(auto place, co_await order.place(core, host));
  place.let_others_go();
  const HostEvent to{place.host, std::move(id.instance), std::move(id.event)};
  co_return co_await core.post_and_await(to, order.timeout());
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
  const auto participant = value_or_throw(ParticipantSource::of_process(domain_options(options)));
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
  return value_or_throw(worker_->run<std::vector<Host>>(
      [this](ClientCore& core) { return list_hosts(worker_->order(), core); }));
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

std::vector<Client::Loss> Client::losses(const std::string& host) {
  return list_or_throw<plc_LossStatus>(*worker_, host);
}

std::vector<Client::Writer> Client::writers(const std::string& host) {
  return list_or_throw<plc_WriterStatus>(*worker_, host);
}

Client::TaskStatistics Client::statistics(const std::string& host, const std::string& instance,
                                          const std::string& task) {
  return value_or_throw(worker_->run<TaskStatistics>(
      [&](ClientCore& core) { return read_statistics(worker_->order(), core, host, instance, task); }));
}

std::vector<std::string> Client::topics() {
  return status_names();
}

std::vector<Client::Record> Client::status(const std::string& topic, const std::string& host) {
  return value_or_throw(worker_->run<std::vector<Record>>(
      [&](ClientCore& core) { return read_topic(worker_->order(), core, topic, host); }));
}

std::vector<Client::LogLine> Client::logs(const std::string& host, const std::string& instance,
                                          unsigned long long newest) {
  return value_or_throw(worker_->run<std::vector<LogLine>>(
      [&](ClientCore& core) { return read_lines(worker_->order(), core, host, instance, {}, newest); }));
}

std::vector<Client::LogLine> Client::logs(const std::string& host, const std::string& instance,
                                          const LogLine& after) {
  const LogPlace from{.stream = after.stream, .after = after.number};
  return value_or_throw(worker_->run<std::vector<LogLine>>([&](ClientCore& core) {
    return read_lines(worker_->order(), core, host, instance, from, kLogRecordsKept);
  }));
}

Client::Posted Client::post(const std::string& host, const std::string& event, unsigned long long count) {
  return posted_or_throw(outcome_of(worker_->run<PostReport>(
      [&](ClientCore& core) { return post_to(worker_->order(), core, host, event, count); })));
}

void Client::post(const std::string& host, const std::string& event,
                  std::function<void(const Outcome&)> done) {
  check_callback(static_cast<bool>(done));
  worker_->begin<PostReport>(
      [this, host, event](ClientCore& core) { return post_to(worker_->order(), core, host, event, 1); },
      [done = std::move(done)](const Result<PostReport>& report) { done(outcome_of(report)); });
}

Client::Posted Client::post_all(const std::string& host, const std::vector<std::string>& events) {
  std::vector<EventId> ids;
  for (const std::string& event : events) ids.push_back(value_or_throw(event_of(event)));
  return posted_or_throw(outcome_of(worker_->run<PostReport>(
      [&](ClientCore& core) { return post_batch(worker_->order(), core, host, ids); })));
}

Client::Run Client::post_and_wait(const std::string& host, const std::string& event) {
  const EventId id = value_or_throw(event_of(event));
  const auto run = value_or_throw(worker_->run<RunReport>(
      [&](ClientCore& core) { return post_and_await(worker_->order(), core, host, id); }));
  return {.tasks = run.tasks,
          .last_task = run.last_task,
          .to_start = run.to_start,
          .to_end = run.to_end,
          .round_trip = run.round_trip};
}

}  // namespace plchost
