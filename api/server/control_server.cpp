#include "api/server/control_server.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include <pthread.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "api/dds/log_page.hpp"
#include "api/dds/sample_identity.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "api/dds/time_limit.hpp"
#include "api/dds/told_keys.h"
#include "api/security/identity.hpp"
#include "api/server/control_server_parts.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"
#include "shm/guard/memory_guard.hpp"
#include "shm/log/log.hpp"
#include "shm/variables/order_text.hpp"

namespace plchost {

namespace {

/// Why a request is not done that came late, or does not say until when it may be done.
Error untimely(const plc_TimeLimit& limit) {
  auto late = check_in_time(limit.clock_ns);
  if (limit.epoch != 0 && !late) return std::move(late).error();
  return {.code = ErrorCode::invalid_argument,
          .system_errno = 0,
          .message = "the request has no time limit; fill in Request.limit by the host's newest Presence"};
}

/// Empties a timer, event or signal descriptor.
void drain(int fd) noexcept {
  std::array<std::byte, sizeof(signalfd_siginfo)> buffer;
  (void)!::read(fd, buffer.data(), buffer.size());
}

}  // namespace

void raise_event(int fd) noexcept {
  constexpr std::uint64_t kOne = 1;
  (void)!::write(fd, &kOne, sizeof kOne);
}

Result<std::unique_ptr<ControlServer>> ControlServer::create(ServerOptions options) {
  PLCHOST_TRY(check_name("host", options.host, kMaxHostName));
  PLCHOST_TRY_ASSIGN(auto pool, in_step("cannot attach the pool", ObjectPool::attach(options.pool)));
  const auto epoch = static_cast<std::uint64_t>(unix_time_ns());
  auto parts = std::make_unique<Parts>(std::move(options), std::move(pool), epoch);
  PLCHOST_TRY(parts->open());
  return std::unique_ptr<ControlServer>(new ControlServer(std::move(parts)));
}

ControlServer::ControlServer(std::unique_ptr<Parts> parts) noexcept : parts_(std::move(parts)) {}

ControlServer::~ControlServer() {
  // No listener may run while its objects are taken apart.
  for (auto& request : parts_->requests) request.from.reader.reset();
  parts_->event_posts.reader.reset();
  parts_->event_batches.reader.reset();
  parts_->chunks.reader.reset();
  parts_->name.reset();
  if (parts_->sessions) {
    for (const dds_entity_t reader : parts_->sessions->discovery_readers()) dds_set_listener(reader, nullptr);
  }
  if (parts_->audit) parts_->record_posts();
}

Result<void> ControlServer::run() {
  return parts_->run();
}

void ControlServer::Parts::on_event_post(dds_entity_t reader, void* server) {
  MemoryGuard::watch_thread();
  auto& self = *static_cast<Parts*>(server);
  if (self.intake->take_posts(reader)) raise_event(self.wake.get());
}

void ControlServer::Parts::on_event_batch(dds_entity_t reader, void* server) {
  MemoryGuard::watch_thread();
  auto& self = *static_cast<Parts*>(server);
  if (self.intake->take_batches(reader)) raise_event(self.wake.get());
}

void ControlServer::Parts::on_wake_listener(dds_entity_t /*reader*/, void* server) {
  raise_event(static_cast<Parts*>(server)->wake.get());
}

// Above the threads that receive: a flood of posts shall not keep requests, acknowledgements and the presence
// waiting. The loop's work at a time is bounded.
Result<void> ControlServer::Parts::raise_loop() const {
  if (options.dds.receive_fifo == 0) return {};
  const sched_param priority{.sched_priority = options.dds.receive_fifo + 1};
  return check_returned(::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &priority),
                        "cannot raise the priority of the control loop");
}

Result<void> ControlServer::Parts::run() {
  PLCHOST_TRY(raise_loop());
  for (const int fd : {wake.get(), signals.get(), status_timer.get(), presence_timer.get(), run_timer.get(),
                       identity_timer.get(), manager->fd(), variables->fd()}) {
    epoll_event event{.events = EPOLLIN, .data = {.fd = fd}};
    PLCHOST_TRY(
        check_errno(::epoll_ctl(epoll.get(), EPOLL_CTL_ADD, fd, &event), "cannot watch a descriptor"));
  }
  spdlog::info("host '{}' is served in DDS domain {}", options.host, options.dds.domain);
  for (;;) {
    std::array<epoll_event, 8> events{};
    const int count = ::epoll_wait(epoll.get(), events.data(), static_cast<int>(events.size()), -1);
    if (count < 0 && errno != EINTR) return failure(ErrorCode::system, "cannot wait for events", errno);
    for (int i = 0; i < count; ++i) {
      PLCHOST_TRY_ASSIGN(const auto go_on, dispatch(events[static_cast<std::size_t>(i)].data.fd));
      if (!go_on) return {};
    }
  }
}

Result<bool> ControlServer::Parts::dispatch(int fd) {
  if (fd == manager->fd()) {
    if (auto done = on_manager(); !done) {
      if (done.error().code != ErrorCode::unavailable) return std::unexpected(done.error());
      spdlog::info("the manager is gone: ending");
      return false;
    }
    return true;
  }
  if (fd == variables->fd()) {
    tell_variables(variables->receive());
    return true;
  }
  drain(fd);
  if (fd == wake.get()) {
    on_wake();
    return keeps_name();
  } else if (fd == status_timer.get()) {
    const TimePoint now = MonotonicClock::now();
    write_left_acks();
    record_posts();
    status->look_at_writers(*intake, *sessions, now);
    status->tick(now);
    lister.forget_old(now);
    audit->tick(now);
    const AuditHead head = audit->head();
    status->set_audit({.number = head.number, .hash = head.hash, .problem = audit->problem()});
    send_late_answers(now);
    answer_finished(now);
    finish(manager->expire(now));
    tell_variables(variables->expire(now));
    serve_downloads(now);
  } else if (fd == run_timer.get()) {
    look_at_runs();
  } else if (fd == presence_timer.get()) {
    status->write_presence();
    if (options.beat_fd >= 0) raise_event(options.beat_fd);
  } else if (fd == identity_timer.get()) {
    tell_of_refused(MonotonicClock::now());
    (void)plc_forget_told_keys(event_posts.reader.get());
    // First those that have just come again, else their addresses would be forgotten.
    heap.worked(sessions->follow_discovery(), MonotonicClock::now());
    (void)announcements.forget_gone(sessions->participants());
    (void)heap.look(MonotonicClock::now());
    if (identity_changed()) return false;
    return keeps_name();
  } else if (fd == signals.get()) {
    spdlog::info("asked to end");
    answer_what_was_done();
    return false;
  }
  return true;
}

// They name no client that could be told.
void ControlServer::Parts::tell_of_refused(TimePoint now) {
  const std::uint64_t datagrams = options.refused_datagrams == nullptr ? 0 : options.refused_datagrams();
  if (const auto more = refused_datagrams.take(datagrams, now)) {
    spdlog::warn("{} rejected before DDS could read all of it: no RTPS, or malformed",
                 count_text(more, "datagram was", "datagrams were"));
  }
  if (const auto more = malformed_posts.take(intake->malformed(), now)) {
    spdlog::warn("{} rejected: source differs from the writer, or invalid sequence number",
                 count_text(more, "post"));
  }
}

// Whether what DDS has loaded is not what counts any more, so that a fresh process must load it.
bool ControlServer::Parts::identity_changed() {
  if (!identity_watch) return false;
  const std::string& folder = options.dds.identity;
  const auto change = identity_watch->look();
  if (change == IdentityWatch::Change::none) return false;
  if (change == IdentityWatch::Change::identity) {
    const auto good = security::check_identity(folder);
    if (good) {
      spdlog::info("the files of this host's identity have changed: ending, to begin with them");
      return true;
    }
    spdlog::error("the files of this host's identity have changed and are not used: {}",
                  good.error().describe());
    return false;
  }
  auto known = security::KnownIdentities::load(folder);
  if (!known) {
    spdlog::error("identity: {}", known.error().describe());
    return false;
  }
  for (const std::string& problem : known->problems()) spdlog::warn("identity: {}", problem);
  spdlog::info("{} known", count_text(known->size(), "identity is", "identities are"));
  guard.replace(std::move(*known));
  return false;
}

// Whether this host goes on under its name; false: it does, with a fresh process.
Result<bool> ControlServer::Parts::keeps_name() {
  const NameClaim::State state = name->look(MonotonicClock::now());
  if (state == NameClaim::State::taken) return std::unexpected(name->leave(signals.get()));
  status->set_rival(name->rival());
  if (state == NameClaim::State::ours) return true;
  spdlog::warn("the other host of the name '{}' is gone: ending, to tell all status anew", options.host);
  return false;
}

void ControlServer::Parts::on_wake() {
  heap.worked(sessions->follow_discovery(), MonotonicClock::now());
  write_left_acks();
  send_late_answers(MonotonicClock::now());
  for (const AwaitedPost& post : intake->collect_awaited()) runs.add(post, status->tasks());
  if (!runs.empty()) look_at_runs();
  for (const RequestReader& request : requests) on_requests(request);
  on_chunks();
}

// Those that the receiving thread has left.
void ControlServer::Parts::write_left_acks() {
  for (const plc_EventAck& ack : intake->collect_acks()) {
    sessions->write_ack(dds::Guid::from(ack.source).participant(), ack);
  }
}

void ControlServer::Parts::record_posts() {
  const TimePoint now = MonotonicClock::now();
  audit->posted_to(intake->collect_posted(), now);
  for (const plc_EventAck& ack : intake->collect_written_acks()) {
    heap.worked(1, now);
    sessions->was_answered(dds::Guid::from(ack.source).participant(), now);
    audit->posted(ack, now);
  }
}

void ControlServer::Parts::look_at_runs() {
  for (const plc_EventRun& run : runs.look(status->tasks(), MonotonicClock::now())) {
    sessions->write_run(dds::Guid::from(run.source).participant(), run);
  }
  const timespec period = to_timespec(runs.empty() ? Duration::zero() : RunWatch::kPeriod);
  const itimerspec times{.it_interval = period, .it_value = period};
  (void)::timerfd_settime(run_timer.get(), 0, &times, nullptr);
}

// So many at a time: a flood of requests shall not keep acknowledgements and the presence waiting.
void ControlServer::Parts::on_requests(const RequestReader& source) {
  constexpr std::size_t kAtOnce = 16;
  const dds::Samples<plc_Request, kAtOnce> batch(source.from.reader.get());
  heap.worked(batch.size(), MonotonicClock::now());
  for (std::size_t i = 0; i < batch.size(); ++i) {
    if (batch.valid(i)) on_request(source, batch[i], batch.info(i));
  }
  if (batch.full()) raise_event(wake.get());
}

void ControlServer::Parts::on_request(const RequestReader& source, const plc_Request& request,
                                      const dds_sample_info_t& info) {
  const dds::Guid writer = dds::writer_of(source.from.reader.get(), info);
  // Gone meanwhile, or pretending to be another: nobody to answer.
  if (writer == dds::Guid{}) return;
  const dds::Guid client = writer.participant();
  // Where nothing can be answered, nothing is done: it is asked again.
  if (!sessions->serves(client)) return;
  if (writer != dds::Guid::from(request.header.request_identity.writer_guid)) {
    return refuse(client, request,
                  {.code = ErrorCode::refused,
                   .system_errno = 0,
                   .message = "the request's identity is not that of its writer"});
  }
  if (const auto may = guard.check(writer, role_of(source.role)); !may)
    return refuse(client, request, may.error());
  do_request(source.role, writer, request);
}

// Not by its identity: that may be of another's request that is under way.
void ControlServer::Parts::refuse(const dds::Guid& client, const plc_Request& request, const Error& error) {
  audit->refused(client, request, error, MonotonicClock::now());
  send_answer(client, request.header.request_identity, error.code, error.message);
}

void ControlServer::Parts::do_request(ApiRole role, const dds::Guid& writer, const plc_Request& request) {
  const plc_SampleIdentity& identity = request.header.request_identity;
  const dds::Guid client = writer.participant();
  if (const Answer* const known = answers.find(client, identity)) return send(client, *known);
  if (manager->is_pending(identity) || is_late(identity) || downloads.repeat(identity)) return;
  if (variables->is_pending(identity)) return;
  const auto timeliness = dds::timeliness(request.limit, epoch);
  if (timeliness == dds::Timeliness::other_epoch) return;  // it comes again, with another limit
  if (timeliness != dds::Timeliness::in_time) return refuse(client, request, untimely(request.limit));
  audit->asked(client, request);
  const std::vector<std::string_view> instances(status->instances().begin(), status->instances().end());
  auto checked = check_request(request, role, options.host, instances);
  if (!checked) return answer(client, identity, checked.error().code, checked.error().describe());
  const auto may = options.variable_rights.check(operation_of(checked->verb).right, guard, writer);
  if (!may) return answer(client, identity, may.error().code, may.error().describe());
  if (checked->verb == ControlVerb::read_clock) return tell(client, identity, ErrorCode::ok, "");
  if (checked->verb == ControlVerb::list_objects) return list_objects(client, request);
  if (checked->verb == ControlVerb::list_nodes || checked->verb == ControlVerb::list_routes) {
    return list_nodes(checked->verb, client, request);
  }
  if (checked->verb == ControlVerb::read_log) return read_log(client, request);
  if (checked->verb == ControlVerb::list_variables) return list_variables(client, request);
  if (checked->verb == ControlVerb::read_debug) return read_debug(client, request);
  if (checked->verb == ControlVerb::read_trace) return read_trace(client, request);
  audit->handed_on(identity);
  if (!operation_of(checked->verb).only_reads) checked->id = request_id(identity);
  if (checked->verb == ControlVerb::download_application) {
    return begin_download(client, identity, *std::move(checked));
  }
  // A request that this server gives up is not begun either.
  checked->limit_ns =
      std::min<std::int64_t>(request.limit.clock_ns, boot_time_ns() + ManagerLink::kCommandLimit.count());
  const PendingCommand command{
      client,        identity, checked->instance, MonotonicClock::now() + ManagerLink::kCommandLimit,
      checked->verb, {}};
  if (auto sent = manager->send(std::move(*checked), command); !sent) {
    answer(client, identity, sent.error().code, sent.error().describe());
  }
}

Result<void> ControlServer::Parts::on_manager() {
  PLCHOST_TRY_ASSIGN(auto finished, manager->receive());
  finish(std::move(finished));
  return {};
}

void ControlServer::Parts::finish(std::vector<FinishedCommand> commands) {
  for (FinishedCommand& command : commands) {
    if (command.command.verb == ControlVerb::check_host && !collect_findings(command)) continue;
    unanswered.push_back(std::move(command));
  }
  answer_finished(MonotonicClock::now());
}

// A client that looks at the status after the answer sees the effect of the command. For that the pool is
// listed, which takes its time if it is large: once for all that have finished meanwhile.
void ControlServer::Parts::answer_finished(TimePoint now) {
  if (unanswered.empty() || !status->may_flush(now)) return;
  std::vector<std::string> instances;
  for (const FinishedCommand& command : unanswered) instances.push_back(command.command.instance);
  if (!unanswered_since) unanswered_since = now;
  if (!status->flush(instances, now) && now - *unanswered_since < kPagePatience) return;
  unanswered_since.reset();
  for (const FinishedCommand& command : std::exchange(unanswered, {})) {
    downloads.end(command.command.identity);
    answer_recorded(command.command.client, command.command.identity, command.code, text_for_client(command),
                    command.text);
  }
}

// The manager's findings at its start are published without being asked for.
void ControlServer::Parts::ask_for_findings() {
  PendingCommand nobody;
  nobody.deadline = MonotonicClock::now() + ManagerLink::kCommandLimit;
  nobody.verb = ControlVerb::check_host;
  const auto sent =
      manager->send({.number = 0, .verb = ControlVerb::check_host, .instance = {}, .argument = {}}, nobody);
  if (!sent) spdlog::warn("the host is not checked: {}", sent.error().describe());
}

// One part of the findings: asks for the next one, or publishes them all. Returns true when somebody is to be
// answered.
bool ControlServer::Parts::collect_findings(FinishedCommand& finished) {
  if (finished.code == ErrorCode::ok) {
    auto next = finished.command.findings.add(finished.text);
    finished.text.clear();
    if (next && *next) {
      const ControlRequest request{
          .number = 0, .verb = ControlVerb::check_host, .instance = {}, .argument = **next};
      if (manager->send(request, finished.command)) return false;
      next = failure(ErrorCode::busy, "the manager does not take the request for the rest of the findings");
    }
    if (next) {
      status->publish_findings(finished.command.findings.findings());
    } else {
      finished.code = next.error().code;
      finished.text = next.error().describe();
    }
  }
  const bool asked = finished.command.client != dds::Guid{};
  if (!asked && finished.code != ErrorCode::ok) spdlog::warn("the host is not checked: {}", finished.text);
  return asked;
}

// The answer to a write tells the value that was there.
std::string_view ControlServer::Parts::text_for_client(const FinishedCommand& command) const {
  const ControlVerb verb = command.command.verb;
  const bool has_values = command.code == ErrorCode::ok &&
                          (verb == ControlVerb::write_variable || verb == ControlVerb::force_variable);
  if (!has_values) return command.text;
  const auto may =
      options.variable_rights.check(OperationRight::read_variables, guard, command.command.client);
  return may ? command.text : without_values(command.text);
}

void ControlServer::Parts::answer_recorded(const dds::Guid& client, const plc_SampleIdentity& identity,
                                           ErrorCode code, std::string_view text, std::string_view recorded) {
  const TimePoint now = MonotonicClock::now();
  const AuditWriter::Ticket ticket = audit->answered(identity, code, recorded, now);
  if (audit->is_written(ticket)) return send_answer(client, identity, code, text);
  late_answers.push_back({client, identity, code, std::string(text), ticket, now + kAuditPatience});
}

bool ControlServer::Parts::is_late(const plc_SampleIdentity& identity) const {
  const auto is_its = [&](const plc_SampleIdentity& other) { return same_identity(other, identity); };
  return std::ranges::any_of(late_answers, is_its, &LateAnswer::identity) ||
         std::ranges::any_of(unanswered, [&](const auto& one) { return is_its(one.command.identity); });
}

// A disk that hangs delays an answer; it prevents none.
void ControlServer::Parts::send_late_answers(TimePoint now) {
  while (!late_answers.empty()) {
    const LateAnswer& answer = late_answers.front();
    if (!audit->is_written(answer.ticket) && now < answer.deadline) return;
    send_answer(answer.client, answer.identity, answer.code, answer.text);
    late_answers.pop_front();
  }
}

// Otherwise the next server would be asked to do it again.
void ControlServer::Parts::answer_what_was_done() {
  if (auto finished = manager->receive()) finish(std::move(*finished));
  const TimePoint end = MonotonicClock::now() + kPagePatience + kAuditPatience;
  for (TimePoint now = MonotonicClock::now(); now < end; now = MonotonicClock::now()) {
    answer_finished(now);
    send_late_answers(now);
    if (unanswered.empty() && late_answers.empty()) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void ControlServer::Parts::send_answer(const dds::Guid& client, const plc_SampleIdentity& identity,
                                       ErrorCode code, std::string_view text) {
  Answer answer{
      .identity = identity, .code = code, .status_round = status->round(), .text = std::string(text)};
  send(client, answer);
  answers.remember(client, std::move(answer), MonotonicClock::now());
}

// A read-only request is done again when it is repeated.
void ControlServer::Parts::tell(const dds::Guid& client, const plc_SampleIdentity& identity, ErrorCode code,
                                std::string_view text) {
  send(client,
       {.identity = identity, .code = code, .status_round = status->round(), .text = std::string(text)});
}

void ControlServer::Parts::send(const dds::Guid& client, const Answer& answer) {
  plc_Reply reply{};
  reply.header.related_identity = answer.identity;
  reply.header.remote_ex = remote_exception(answer.code);
  dds::copy_text(reply.host, options.host);
  reply.code = static_cast<std::int32_t>(answer.code);
  reply.status_round = answer.status_round;
  dds::copy_text(reply.text, shortened(answer.text, sizeof reply.text - 1));
  sessions->write_reply(client, reply);
}

}  // namespace plchost
