#include <array>
#include <csignal>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>

#include "api/dds/error.hpp"
#include "api/dds/log_sink.hpp"
#include "api/dds/qos.hpp"
#include "api/dds/secured_announcement.h"
#include "api/security/identity.hpp"
#include "api/server/control_server_parts.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

/// How often the files of the host's identity are looked at.
constexpr Duration kIdentityLook = std::chrono::milliseconds(500);

/// A period of 0: it is not set.
Result<UniqueFd> make_timer(Duration period) {
  PLCHOST_TRY_ASSIGN(const auto fd, check_errno(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK),
                                                "cannot create a timer"));
  UniqueFd timer(fd);
  const itimerspec times{.it_interval = to_timespec(period), .it_value = to_timespec(period)};
  PLCHOST_TRY(check_errno(::timerfd_settime(timer.get(), 0, &times, nullptr), "cannot set a timer"));
  return timer;
}

Result<UniqueFd> make_signal_fd() {
  sigset_t set;
  ::sigemptyset(&set);
  ::sigaddset(&set, SIGTERM);
  ::sigaddset(&set, SIGINT);
  // Before any thread of DDS is made: they inherit it.
  PLCHOST_TRY(check_returned(::pthread_sigmask(SIG_BLOCK, &set, nullptr), "cannot block signals"));
  PLCHOST_TRY_ASSIGN(const auto fd, check_errno(::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK),
                                                "cannot create a signal descriptor"));
  return UniqueFd(fd);
}

}  // namespace

Result<void> ControlServer::Parts::open() {
  PLCHOST_TRY(make_loop());
  PLCHOST_TRY(make_guard());
  PLCHOST_TRY_ASSIGN(auto ledger, PostLedger::open(pool));
  PLCHOST_TRY_ASSIGN(manager, ManagerLink::connect(options.run_directory));
  PLCHOST_TRY_ASSIGN(variables, VariableLister::create(options.pool, options.run_directory));
  intake.emplace(options.host, pool, std::move(ledger), epoch, guard);
  PLCHOST_TRY(enter_domain());
  PLCHOST_TRY(claim_name());
  open_audit();
  PLCHOST_TRY_ASSIGN(sessions, SessionTable::create(participant.get(), options.host));
  intake->acknowledge_by(sessions->ack_writers());
  PLCHOST_TRY_ASSIGN(
      auto made_status,
      StatusPublisher::create(participant.get(), {options.host, &pool, epoch, options.run_directory,
                                                  fmt::format("{}", fmt::join(options.labels, ",")),
                                                  identity_watch.has_value(), options.applications_folder}));
  status.emplace(std::move(made_status));
  // Everything is there before a client can see that this host is: presence comes last.
  status->look_at_writers(*intake, *sessions, MonotonicClock::now());
  status->tick(MonotonicClock::now());
  PLCHOST_TRY(make_readers());
  PLCHOST_TRY(listen());
  PLCHOST_TRY(open_gateway());
  status->write_presence();
  ask_for_findings();
  return {};
}

// Without a log the plant can be stopped, too: nothing waits for it.
void ControlServer::Parts::open_audit() {
  const auto describe = [this](const dds::Guid& client, AuditRecord& record) {
    if (const auto subject = guard.identity_of(client)) {
      record.who = fmt::format("{} {}", security::to_string(subject->role), subject->name);
    }
    record.from = sessions->describe(client);
  };
  const auto recorded = [this](const dds::Guid& source, std::uint64_t accepted) {
    intake->note_recorded(source, accepted);
  };
  audit.emplace(options.audit_folder, describe, [fd = wake.get()] { raise_event(fd); }, recorded);
  intake->note_sources_since(MonotonicClock::now() - 2 * RequestAudit::kPostPeriod);
}

Result<void> ControlServer::Parts::open_gateway() {
  if (options.host_number == 0) return {};
  PLCHOST_TRY_ASSIGN(gateway,
                     GatewayThread::start(participant.get(), {.pool = options.pool,
                                                              .base = options.blocks_base,
                                                              .host = options.host,
                                                              .number = options.host_number,
                                                              .since_ns = status->host().started_unix_ns,
                                                              .epoch = epoch}));
  return {};
}

Result<void> ControlServer::Parts::make_loop() {
  PLCHOST_TRY_ASSIGN(signals, make_signal_fd());
  PLCHOST_TRY_ASSIGN(status_timer, make_timer(StatusPublisher::kTick));
  PLCHOST_TRY_ASSIGN(presence_timer, make_timer(dds::kPresencePeriod));
  PLCHOST_TRY_ASSIGN(identity_timer, make_timer(kIdentityLook));
  PLCHOST_TRY_ASSIGN(run_timer, make_timer(Duration::zero()));
  PLCHOST_TRY_ASSIGN(const auto event, check_errno(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK),
                                                   "cannot create an event descriptor"));
  wake.reset(event);
  PLCHOST_TRY_ASSIGN(const auto loop,
                     check_errno(::epoll_create1(EPOLL_CLOEXEC), "cannot create an epoll descriptor"));
  epoll.reset(loop);
  return {};
}

Result<void> ControlServer::Parts::make_guard() {
  const std::string& folder = options.dds.identity;
  const bool only_loopback = options.dds.interfaces == std::vector<std::string>{"lo"};
  if (folder.empty()) {
    if (only_loopback || options.allow_unsecured) return {};
    return failure(ErrorCode::refused,
                   fmt::format("without an identity this host would be open to all who reach interface {}: "
                               "give it one ([dds] identity), or allow that ([dds] allow_unsecured = true)",
                               fmt::join(options.dds.interfaces, ", ")));
  }
  // Before what is watched is read: no change is missed.
  identity_watch.emplace(folder);
  PLCHOST_TRY_ASSIGN(const auto own, in_step("identity", security::check_identity(folder)));
  PLCHOST_TRY(in_step("identity", security::check_host_identity(own.subject, options.host)));
  PLCHOST_TRY_ASSIGN(auto known, in_step("identity", security::KnownIdentities::load(folder)));
  for (const std::string& problem : known.problems()) spdlog::warn("identity: {}", problem);
  spdlog::info("secured: identity '{}', {} known", own.subject.name,
               count_text(known.size(), "identity is", "identities are"));
  const std::time_t left = own.validity.not_after - std::time(nullptr);
  if (left < security::kExpiresSoon) {
    spdlog::warn("identity '{}' expires in {}: 'plcctl security renew {}'", own.subject.name,
                 count_text(static_cast<std::uint64_t>(std::max<std::time_t>(left / 86'400, 0)), "day"),
                 own.subject.name);
  }
  guard.replace(std::move(known));
  return {};
}

Result<void> ControlServer::Parts::enter_domain() {
  dds::install_log_sink();
  PLCHOST_TRY_ASSIGN(domain, dds::open_domain(dds::Role::server, options.dds));
  dds::Qos qos;
  if (!options.announced.empty()) qos.user_data(options.announced);
  PLCHOST_TRY_ASSIGN(participant,
                     dds::make_participant(options.dds.domain, qos.get(),
                                           "enter DDS domain " + std::to_string(options.dds.domain) +
                                               " (at most 16 servers on one machine)"));
  if (identity_watch && !plc_announce_secured(participant.get())) {
    spdlog::warn(
        "secured clients by Fast DDS 3 cannot connect: the participant of this host is not announced to "
        "them");
  }
  announcements = dds::Announcements(participant.get());
  if (options.dds.interfaces == std::vector<std::string>{"lo"}) {
    if (const auto tied = dds::tie_sockets_to_loopback(); !tied) {
      spdlog::warn("packets from outside reach the parser of this server: {}", tied.error().describe());
    }
    if (!identity_watch) spdlog::info("unsecured, therefore on the loopback interface only");
  } else if (!identity_watch) {
    spdlog::warn(
        "unsecured, and not on the loopback interface only: any program that reaches it controls this host");
  }
  return {};
}

// Before anything is shown under the name. A server that had the name a moment ago has no time to ask.
Result<void> ControlServer::Parts::claim_name() {
  const TimePoint entered = MonotonicClock::now();
  PLCHOST_TRY_ASSIGN(
      name, NameClaim::create(participant.get(),
                              {.host = options.host,
                               .run_directory = options.run_directory,
                               .epoch = epoch,
                               .since_ns = options.name_since_ns != 0 ? options.name_since_ns
                                                                      : static_cast<std::int64_t>(epoch),
                               .serving = options.name_held}));
  return name->ask(entered + (options.name_refused ? NameClaim::kAskingAgain : NameClaim::kAsking),
                   signals.get());
}

Result<void> ControlServer::Parts::make_readers() {
  PLCHOST_TRY_ASSIGN(subscriber, dds::make_subscriber(participant.get(), dds::host_partition(options.host)));
  const auto open = [&](const dds::TopicInfo& info, dds::TopicReader& from) -> Result<void> {
    PLCHOST_TRY_ASSIGN(from,
                       dds::open_reader(participant.get(), subscriber.get(), info, dds::bounded_qos(info)));
    return {};
  };
  PLCHOST_TRY(open(dds::kDownloadChunk, chunks));
  PLCHOST_TRY(open(dds::kEventPost, event_posts));
  PLCHOST_TRY(open(dds::kEventBatch, event_batches));
  constexpr std::array kRoles{ApiRole::viewing, ApiRole::operating, ApiRole::engineering};
  for (std::size_t i = 0; i < kRoles.size(); ++i) {
    requests[i].role = kRoles[i];
    PLCHOST_TRY(open(request_topic(kRoles[i]), requests[i].from));
  }
  return {};
}

Result<void> ControlServer::Parts::listen() {
  const auto set = [&](dds_entity_t reader, dds_on_data_available_fn function) {
    dds_listener_t* const listener = dds_create_listener(this);
    dds_lset_data_available(listener, function);
    const dds_return_t returned = dds_set_listener(reader, listener);
    dds_delete_listener(listener);
    return dds::check_code(returned, "cannot listen to a reader");
  };
  for (const dds_entity_t reader : sessions->discovery_readers()) {
    PLCHOST_TRY(set(reader, on_wake_listener));
  }
  PLCHOST_TRY(set(name->reader(), on_wake_listener));
  for (const RequestReader& request : requests) {
    PLCHOST_TRY(set(request.from.reader.get(), on_wake_listener));
  }
  PLCHOST_TRY(set(chunks.reader.get(), on_wake_listener));
  PLCHOST_TRY(set(event_posts.reader.get(), on_event_post));
  PLCHOST_TRY(set(event_batches.reader.get(), on_event_batch));
  // A sample that came before the listener was there does not call it.
  on_event_post(event_posts.reader.get(), this);
  on_event_batch(event_batches.reader.get(), this);
  raise_event(wake.get());
  return {};
}

}  // namespace plchost
