#include "api/client/client_core.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/error.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

Result<std::unique_ptr<ClientCore>> ClientCore::connect(std::shared_ptr<Participant> participant,
                                                        std::string_view only) {
  // A pattern would be one of partitions.
  if (!only.empty()) {
    PLCHOST_TRY(check_host_name(only));
  }
  std::unique_ptr<ClientCore> core(new ClientCore);
  PLCHOST_TRY(core->open(std::move(participant), only));
  return core;
}

Result<void> ClientCore::open(std::shared_ptr<Participant> participant, std::string_view only) {
  participant_ = std::move(participant);
  only_ = only;
  partition_ = dds::client_partition(dds::guid_of(entity()).hex(), dds::kAllHosts);
  PLCHOST_TRY_ASSIGN(
      status_subscriber_,
      dds::make_subscriber(entity(), dds::status_partition(only.empty() ? dds::kAllHosts : only)));
  PLCHOST_TRY_ASSIGN(auto set, WaitSet::create(entity()));
  pump_ = std::make_unique<Pump>(std::move(set), [this](bool several) { take(several); });
  last_news_ = MonotonicClock::now();
  if (!participant_->only_loopback) quiet_ = kQuietOnNetworks;
  // It comes again every 25 ms, so a lost one is not asked for. In a fleet, acknowledgements of each presence
  // would be more than half of all datagrams.
  dds::Qos repeated = dds::shown_qos(dds::kPresence);
  repeated.best_effort();
  PLCHOST_TRY(open_cache(
      presence_, dds::kPresence, repeated,
      DDS_DATA_AVAILABLE_STATUS | DDS_REQUESTED_DEADLINE_MISSED_STATUS | DDS_SUBSCRIPTION_MATCHED_STATUS));
  return open_cache(host_status_, dds::kHostStatus);
}

void ClientCore::take(bool several) {
  // When it was an acknowledgement that has woken a client that posts, nothing stands between that and the
  // next post.
  const bool only_posts = take_acks(MonotonicClock::now()) && !several;
  take_answers(only_posts ? Answers::expected : Answers::all);
  if (!only_posts) update();
}

void ClientCore::look() {
  (void)take_acks(MonotonicClock::now());
  take_answers(Answers::all);
  update();
  pump_->look_again();
}

void ClientCore::update() {
  update_hosts();
  std::apply([](auto&... cache) { (cache.update(), ...); }, status_);
  statistics_.update();
  host_findings_.update();
}

void ClientCore::take_answers(Answers which) {
  if (wants(which, replies_, replied_)) take_replies();
  if (wants(which, runs_, run_)) take_runs();
  if (wants(which, download_acks_, downloaded_)) take_download_acks();
  take_pages(which);
}

template Result<void> ClientCore::open_cache(StatusCache<plc_HostFinding>&, const dds::TopicInfo&);

Async<Result<StatisticsReport>> ClientCore::statistics(std::string host, std::string instance,
                                                       std::string task, TimePoint deadline) {
  PLCHOST_CO_TRY(check_host_name(host, only_));
  PLCHOST_CO_TRY(check_task_name(instance, task));
  PLCHOST_CO_TRY(open_cache(statistics_, dds::kTaskStatistics));
  look();
  for (;;) {
    if (const auto view = present(host)) {
      if (auto found = statistics_.find(host, view->epoch, instance, task)) co_return *std::move(found);
    }
    if (MonotonicClock::now() >= deadline) break;
    co_await pump_->change(deadline);
  }
  co_return failure(
      ErrorCode::timed_out,
      fmt::format("the statistics of task '{}/{}' have not come from host '{}'", instance, task, host));
}

Result<std::vector<TransitionView>> ClientCore::transitions() {
  if (!transition_log_) {
    PLCHOST_TRY_ASSIGN(auto opened, open_reader(entity(), status_subscriber_.get(), dds::kTransition,
                                                dds::qos_of(dds::kTransition), pump_->set()));
    transition_log_ = TransitionLog(std::move(opened));
  }
  look();
  return transition_log_.take();
}

Async<Result<bool>> ClientCore::has_all_transitions(std::string host, TimePoint deadline) {
  PLCHOST_CO_TRY_ASSIGN(const auto told, co_await status<plc_InstanceStatus>(host, deadline));
  co_return std::ranges::all_of(told,
                                [&](const plc_InstanceStatus& one) { return transition_log_.has_all(one); });
}

// With the subscriber to its partition, if there is none yet.
Result<dds::Entity> ClientCore::make_own_topic(const dds::TopicInfo& info) {
  if (!own_subscriber_) {
    PLCHOST_TRY_ASSIGN(own_subscriber_, dds::make_subscriber(entity(), partition_));
  }
  return dds::make_topic(entity(), info);
}

Result<void> ClientCore::read_own(dds::TopicReader& answers, dds::Entity topic, const dds::Qos& qos) {
  PLCHOST_TRY_ASSIGN(auto reader, dds::make_reader(own_subscriber_.get(), topic.get(), qos));
  answers = {.topic = std::move(topic), .reader = std::move(reader)};
  return pump_->set().add(answers.reader.get(), DDS_DATA_AVAILABLE_STATUS);
}

const HostClock* ClientCore::clock_of(const std::string& host) const {
  const SeenHost* const seen = seen_.find(host);
  return seen == nullptr || seen->server.value() == 0 ? nullptr : &seen->clock;
}

}  // namespace plchost
