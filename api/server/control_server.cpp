#include "api/server/control_server.hpp"

#include <array>
#include <csignal>
#include <optional>
#include <utility>
#include <vector>

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>

#include "api/dds/error.hpp"
#include "api/dds/log_sink.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "api/server/event_intake.hpp"
#include "api/server/manager_link.hpp"
#include "api/server/request_check.hpp"
#include "api/server/session_table.hpp"
#include "api/server/status_publisher.hpp"
#include "shm/base/log.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

Result<UniqueFd> make_timer(Duration period) {
  const auto fd = check_errno(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK), "make a timer");
  if (!fd) return std::unexpected(fd.error());
  UniqueFd timer(*fd);
  const itimerspec times{.it_interval = to_timespec(period), .it_value = to_timespec(period)};
  if (auto set = check_errno(::timerfd_settime(timer.get(), 0, &times, nullptr), "set a timer"); !set) {
    return std::unexpected(set.error());
  }
  return timer;
}

Result<UniqueFd> make_signal_fd() {
  sigset_t set;
  ::sigemptyset(&set);
  ::sigaddset(&set, SIGTERM);
  ::sigaddset(&set, SIGINT);
  // Before any thread of DDS is made: they inherit it.
  if (auto blocked = check_returned(::pthread_sigmask(SIG_BLOCK, &set, nullptr), "block signals"); !blocked) {
    return std::unexpected(blocked.error());
  }
  const auto fd = check_errno(::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK), "make a signal descriptor");
  if (!fd) return std::unexpected(fd.error());
  return UniqueFd(*fd);
}

/// Empties a timer, event or signal descriptor.
void drain(int fd) noexcept {
  std::array<std::byte, sizeof(signalfd_siginfo)> buffer;
  (void)!::read(fd, buffer.data(), buffer.size());
}

void raise_event(int fd) noexcept {
  constexpr std::uint64_t kOne = 1;
  (void)!::write(fd, &kOne, sizeof kOne);
}

}  // namespace

struct ControlServer::Parts {
  struct RequestReader {
    ApiRole role = ApiRole::operating;
    dds::Entity topic;
    dds::Entity reader;
  };

  Parts(ServerOptions given, ObjectPool attached, std::uint64_t started)
      : options(std::move(given)), pool(std::move(attached)), epoch(started) {}

  Result<void> open(PostLedger ledger);
  Result<void> make_loop();
  Result<void> enter_domain();
  Result<void> make_readers();
  Result<void> listen();
  Result<void> run();
  Result<bool> dispatch(int fd);
  void on_wake();
  void on_requests(const RequestReader& source);
  void on_request(ApiRole role, const dds::Guid& writer, const plc_Request& request);
  Result<void> on_manager();
  void answer(const dds::Guid& client, const plc_SampleIdentity& identity, ErrorCode code,
              std::string_view text);
  void finish(const std::vector<FinishedCommand>& commands);

  static void on_event_post(dds_entity_t reader, void* server);
  static void on_wake_listener(dds_entity_t reader, void* server);

  ServerOptions options;
  ObjectPool pool;
  std::uint64_t epoch;
  UniqueFd epoll;
  UniqueFd wake;
  UniqueFd signals;
  UniqueFd status_timer;
  UniqueFd presence_timer;
  std::optional<ManagerLink> manager;
  std::optional<EventIntake> intake;
  std::shared_ptr<dds::Entity> domain;
  dds::Entity participant;
  std::optional<SessionTable> sessions;
  std::optional<StatusPublisher> status;
  dds::Entity subscriber;
  dds::Entity event_topic;
  dds::Entity event_reader;
  std::array<RequestReader, 2> requests;
};

Result<std::unique_ptr<ControlServer>> ControlServer::create(ServerOptions options) {
  if (auto good = check_name("host", options.host, kMaxHostName); !good) return std::unexpected(good.error());
  auto pool = ObjectPool::attach(options.pool);
  if (!pool) return failure_in("attach the pool", pool.error());
  auto ledger = PostLedger::open(options.pool);
  if (!ledger) return std::unexpected(ledger.error());
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  const auto epoch =
      static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000U + static_cast<std::uint64_t>(now.tv_nsec);
  auto parts = std::make_unique<Parts>(std::move(options), std::move(*pool), epoch);
  if (auto opened = parts->open(std::move(*ledger)); !opened) return std::unexpected(opened.error());
  return std::unique_ptr<ControlServer>(new ControlServer(std::move(parts)));
}

ControlServer::ControlServer(std::unique_ptr<Parts> parts) noexcept : parts_(std::move(parts)) {}

ControlServer::~ControlServer() {
  // No listener may run while what it uses is taken apart.
  for (auto& request : parts_->requests) request.reader.reset();
  parts_->event_reader.reset();
  if (parts_->sessions) {
    for (const dds_entity_t reader : parts_->sessions->discovery_readers()) dds_set_listener(reader, nullptr);
  }
}

Result<void> ControlServer::run() {
  return parts_->run();
}

Result<void> ControlServer::Parts::open(PostLedger ledger) {
  if (auto made = make_loop(); !made) return made;
  auto linked = ManagerLink::connect(options.run_directory);
  if (!linked) return std::unexpected(linked.error());
  manager = std::move(*linked);
  intake.emplace(options.host, pool, std::move(ledger), epoch);
  if (auto entered = enter_domain(); !entered) return entered;
  auto made_sessions = SessionTable::create(participant.get());
  if (!made_sessions) return std::unexpected(made_sessions.error());
  sessions = std::move(*made_sessions);
  auto made_status = StatusPublisher::create(participant.get(), {options.host, &pool, epoch});
  if (!made_status) return std::unexpected(made_status.error());
  status.emplace(std::move(*made_status));
  // Everything is there before a client can see that this host is: presence comes last.
  status->tick(MonotonicClock::now());
  if (auto made = make_readers(); !made) return made;
  if (auto listening = listen(); !listening) return listening;
  status->write_presence();
  return {};
}

Result<void> ControlServer::Parts::make_loop() {
  auto made_signals = make_signal_fd();
  if (!made_signals) return std::unexpected(made_signals.error());
  signals = std::move(*made_signals);
  auto made_status = make_timer(StatusPublisher::kTick);
  if (!made_status) return std::unexpected(made_status.error());
  status_timer = std::move(*made_status);
  auto made_presence = make_timer(dds::kPresencePeriod);
  if (!made_presence) return std::unexpected(made_presence.error());
  presence_timer = std::move(*made_presence);
  const auto event = check_errno(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "make an event descriptor");
  if (!event) return std::unexpected(event.error());
  wake.reset(*event);
  const auto loop = check_errno(::epoll_create1(EPOLL_CLOEXEC), "make an epoll descriptor");
  if (!loop) return std::unexpected(loop.error());
  epoll.reset(*loop);
  return {};
}

Result<void> ControlServer::Parts::enter_domain() {
  dds::install_log_sink();
  auto opened = dds::open_domain(dds::Role::server, options.dds);
  if (!opened) return std::unexpected(opened.error());
  domain = std::move(*opened);
  auto made = dds::check_entity(
      dds_create_participant(options.dds.domain, nullptr, nullptr),
      "enter DDS domain " + std::to_string(options.dds.domain) + " (at most 16 servers on one machine)");
  if (!made) return std::unexpected(made.error());
  participant = std::move(*made);
  if (options.dds.interfaces == std::vector<std::string>{"lo"}) {
    if (const auto tied = dds::tie_sockets_to_loopback(); !tied) {
      spdlog::warn("packets from outside reach this unsecured server: {}", tied.error().describe());
    }
    spdlog::info("unsecured, therefore on the loopback interface only");
  } else {
    spdlog::warn("unsecured, and not on the loopback interface only: who reaches it controls this host");
  }
  return {};
}

Result<void> ControlServer::Parts::make_readers() {
  auto made_subscriber = dds::make_subscriber(participant.get(), dds::host_partition(options.host));
  if (!made_subscriber) return std::unexpected(made_subscriber.error());
  subscriber = std::move(*made_subscriber);
  const auto make = [&](const dds::TopicInfo& info, const dds::Qos& qos, dds::Entity& topic,
                        dds::Entity& reader) -> Result<void> {
    auto made_topic = dds::make_topic(participant.get(), info);
    if (!made_topic) return std::unexpected(made_topic.error());
    topic = std::move(*made_topic);
    auto made_reader = dds::make_reader(subscriber.get(), topic.get(), qos);
    if (!made_reader) return std::unexpected(made_reader.error());
    reader = std::move(*made_reader);
    return {};
  };
  requests[0].role = ApiRole::operating;
  requests[1].role = ApiRole::engineering;
  auto request_qos = dds::request_qos();
  request_qos.max_samples(dds::kRequestReaderDepth);
  auto event_qos = dds::event_qos();
  event_qos.max_samples(dds::kEventReaderDepth);
  if (auto made = make(dds::kEvent, event_qos, event_topic, event_reader); !made) return made;
  if (auto made = make(dds::kOperatorRequest, request_qos, requests[0].topic, requests[0].reader); !made)
    return made;
  return make(dds::kEngineerRequest, request_qos, requests[1].topic, requests[1].reader);
}

Result<void> ControlServer::Parts::listen() {
  const auto set = [&](dds_entity_t reader, dds_on_data_available_fn function) {
    dds_listener_t* const listener = dds_create_listener(this);
    dds_lset_data_available(listener, function);
    const dds_return_t returned = dds_set_listener(reader, listener);
    dds_delete_listener(listener);
    return dds::check_code(returned, "listen to a reader");
  };
  for (const dds_entity_t reader : sessions->discovery_readers()) {
    if (auto done = set(reader, on_wake_listener); !done) return done;
  }
  for (const RequestReader& request : requests) {
    if (auto done = set(request.reader.get(), on_wake_listener); !done) return done;
  }
  if (auto done = set(event_reader.get(), on_event_post); !done) return done;
  // What came before the listener was there does not call it.
  on_event_post(event_reader.get(), this);
  raise_event(wake.get());
  return {};
}

void ControlServer::Parts::on_event_post(dds_entity_t reader, void* server) {
  auto& self = *static_cast<Parts*>(server);
  if (self.intake->take(reader)) raise_event(self.wake.get());
}

void ControlServer::Parts::on_wake_listener(dds_entity_t /*reader*/, void* server) {
  raise_event(static_cast<Parts*>(server)->wake.get());
}

Result<void> ControlServer::Parts::run() {
  for (const int fd : {wake.get(), signals.get(), status_timer.get(), presence_timer.get(), manager->fd()}) {
    epoll_event event{.events = EPOLLIN, .data = {.fd = fd}};
    if (auto added = check_errno(::epoll_ctl(epoll.get(), EPOLL_CTL_ADD, fd, &event), "watch a descriptor");
        !added) {
      return std::unexpected(added.error());
    }
  }
  spdlog::info("host '{}' is served in DDS domain {}", options.host, options.dds.domain);
  for (;;) {
    std::array<epoll_event, 8> events{};
    const int count = ::epoll_wait(epoll.get(), events.data(), static_cast<int>(events.size()), -1);
    if (count < 0 && errno != EINTR) return failure(ErrorCode::system, "wait for events", errno);
    for (int i = 0; i < count; ++i) {
      const auto go_on = dispatch(events[static_cast<std::size_t>(i)].data.fd);
      if (!go_on) return std::unexpected(go_on.error());
      if (!*go_on) return {};
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
  drain(fd);
  if (fd == wake.get()) {
    on_wake();
  } else if (fd == status_timer.get()) {
    const TimePoint now = MonotonicClock::now();
    status->tick(now);
    finish(manager->expire(now));
  } else if (fd == presence_timer.get()) {
    status->write_presence();
  } else if (fd == signals.get()) {
    spdlog::info("asked to end");
    return false;
  }
  return true;
}

void ControlServer::Parts::on_wake() {
  sessions->follow_discovery();
  for (const plc_EventAck& ack : intake->collect_acks()) {
    sessions->write_ack(dds::Guid::from(ack.source).participant(), ack);
  }
  for (const RequestReader& request : requests) on_requests(request);
}

void ControlServer::Parts::on_requests(const RequestReader& source) {
  for (bool more = true; more;) {
    const dds::Samples<plc_Request> batch(source.reader.get());
    for (std::size_t i = 0; i < batch.size(); ++i) {
      if (!batch.valid(i)) continue;
      const dds::Guid writer = dds::writer_of(source.reader.get(), batch.info(i));
      // Gone meanwhile, or pretending to be another: nobody to answer.
      if (writer == dds::Guid{}) continue;
      if (writer != dds::Guid::from(batch[i].header.request_identity.writer_guid)) {
        answer(writer.participant(), batch[i].header.request_identity, ErrorCode::refused,
               "the request's identity is not that of its writer");
        continue;
      }
      on_request(source.role, writer, batch[i]);
    }
    more = batch.full();
  }
}

void ControlServer::Parts::on_request(ApiRole role, const dds::Guid& writer, const plc_Request& request) {
  const plc_SampleIdentity& identity = request.header.request_identity;
  const dds::Guid client = writer.participant();
  if (const auto known = sessions->remembered(client, identity)) return sessions->write_reply(client, *known);
  if (manager->is_pending(identity)) return;
  const std::vector<std::string_view> instances(status->instances().begin(), status->instances().end());
  auto checked = check_request(request, role, options.host, instances);
  if (!checked) return answer(client, identity, checked.error().code, checked.error().describe());
  const PendingCommand command{client, identity, checked->instance,
                               MonotonicClock::now() + ManagerLink::kCommandLimit};
  if (auto sent = manager->send(std::move(*checked), command); !sent) {
    answer(client, identity, sent.error().code, sent.error().describe());
  }
}

Result<void> ControlServer::Parts::on_manager() {
  auto finished = manager->receive();
  if (!finished) return std::unexpected(finished.error());
  finish(*finished);
  return {};
}

void ControlServer::Parts::finish(const std::vector<FinishedCommand>& commands) {
  for (const FinishedCommand& finished : commands) {
    // Who looks at the status after the answer sees what the command did.
    status->flush(finished.command.instance, MonotonicClock::now());
    answer(finished.command.client, finished.command.identity, finished.code, finished.text);
  }
}

void ControlServer::Parts::answer(const dds::Guid& client, const plc_SampleIdentity& identity, ErrorCode code,
                                  std::string_view text) {
  plc_Reply reply{};
  reply.header.related_identity = identity;
  reply.header.remote_ex = remote_exception(code);
  dds::copy_text(reply.host, options.host);
  reply.code = static_cast<std::int32_t>(code);
  reply.status_round = status->round();
  dds::copy_text(reply.text, text);
  sessions->write_reply(client, reply);
}

}  // namespace plchost
