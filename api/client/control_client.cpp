#include "api/client/control_client.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client_status.hpp"
#include "api/dds/error.hpp"
#include "shm/base/names.hpp"
#include "shm/base/operations.hpp"

namespace plchost {

namespace {

bool is_engineering(std::int32_t operation) {
  const Operation* const known = find_operation(operation);
  return known != nullptr && known->role == ApiRole::engineering;
}

}  // namespace

Result<std::unique_ptr<ControlClient>> ControlClient::connect(const dds::DomainOptions& options,
                                                              std::string_view only) {
  PLCHOST_TRY_ASSIGN(auto entered, enter_domain(options));
  return connect(std::move(entered), only);
}

Result<std::unique_ptr<ControlClient>> ControlClient::connect(std::shared_ptr<Participant> participant,
                                                              std::string_view only) {
  // A pattern would be one of partitions.
  if (!only.empty()) {
    PLCHOST_TRY(check_host_name(only));
  }
  std::unique_ptr<ControlClient> client(new ControlClient);
  PLCHOST_TRY(client->open(std::move(participant), only));
  return client;
}

Result<void> ControlClient::open(std::shared_ptr<Participant> participant, std::string_view only) {
  participant_ = std::move(participant);
  only_ = only;
  partition_ = dds::client_partition(dds::guid_of(entity()).hex(), dds::kAllHosts);
  auto subscriber =
      dds::make_subscriber(entity(), dds::status_partition(only.empty() ? dds::kAllHosts : only));
  if (!subscriber) return std::unexpected(subscriber.error());
  status_subscriber_ = *std::move(subscriber);
  PLCHOST_TRY_ASSIGN(wait_set_, WaitSet::create(entity()));
  last_news_ = MonotonicClock::now();
  if (!participant_->only_loopback) quiet_ = kQuietOnNetworks;
  if (auto opened = open_cache(
          presence_, dds::kPresence,
          DDS_DATA_AVAILABLE_STATUS | DDS_REQUESTED_DEADLINE_MISSED_STATUS | DDS_SUBSCRIPTION_MATCHED_STATUS);
      !opened) {
    return opened;
  }
  return open_cache(host_status_, dds::kHostStatus);
}

void ControlClient::update() {
  update_hosts();
  std::apply([](auto&... cache) { (cache.update(), ...); }, status_);
  statistics_.update();
  host_findings_.update();
}

template Result<void> ControlClient::open_cache(StatusCache<plc_HostFinding>&, const dds::TopicInfo&,
                                                std::uint32_t);

Result<std::vector<plc_InstanceStatus>> ControlClient::instances(const std::string& host,
                                                                 TimePoint deadline) {
  return status<plc_InstanceStatus>(host, deadline);
}

Result<std::vector<plc_TaskStatus>> ControlClient::tasks(const std::string& host, TimePoint deadline) {
  return status<plc_TaskStatus>(host, deadline);
}

Result<StatisticsReport> ControlClient::statistics(const std::string& host, std::string_view instance,
                                                   std::string_view task, TimePoint deadline) {
  PLCHOST_TRY(check_host_name(host, only_));
  PLCHOST_TRY(check_task_name(instance, task));
  PLCHOST_TRY(open_cache(statistics_, dds::kTaskStatistics));
  for (;;) {
    update();
    if (const auto view = present(host)) {
      if (auto found = statistics_.find(host, view->epoch, instance, task)) return std::move(*found);
    }
    if (MonotonicClock::now() >= deadline) break;
    wait_set_.wait(deadline);
  }
  return failure(
      ErrorCode::timed_out,
      fmt::format("the statistics of task '{}/{}' have not come from host '{}'", instance, task, host));
}

Result<std::vector<plc_EventStatus>> ControlClient::events(const std::string& host, TimePoint deadline) {
  return status<plc_EventStatus>(host, deadline);
}

Result<std::vector<plc_WriterStatus>> ControlClient::writers(const std::string& host, TimePoint deadline) {
  return status<plc_WriterStatus>(host, deadline);
}

Result<std::vector<TransitionView>> ControlClient::transitions() {
  if (!transition_log_) {
    PLCHOST_TRY_ASSIGN(auto opened, open_reader(entity(), status_subscriber_.get(), dds::kTransition,
                                                dds::qos_of(dds::kTransition), wait_set_));
    transition_log_ = TransitionLog(std::move(opened));
  }
  update();
  return transition_log_.take();
}

Result<bool> ControlClient::has_all_transitions(const std::string& host, TimePoint deadline) {
  PLCHOST_TRY_ASSIGN(const auto told, instances(host, deadline));
  return std::ranges::all_of(told,
                             [&](const plc_InstanceStatus& one) { return transition_log_.has_all(one); });
}

Result<std::vector<plc_ExceptionStatus>> ControlClient::exceptions(const std::string& host,
                                                                   TimePoint deadline) {
  return status<plc_ExceptionStatus>(host, deadline);
}

Result<std::vector<plc_ApplicationStatus>> ControlClient::applications(const std::string& host,
                                                                       TimePoint deadline) {
  return status<plc_ApplicationStatus>(host, deadline);
}

// With the subscriber to its partition, if there is none yet.
Result<dds::Entity> ControlClient::make_own_topic(const dds::TopicInfo& info) {
  if (!own_subscriber_) {
    PLCHOST_TRY_ASSIGN(own_subscriber_, dds::make_subscriber(entity(), partition_));
  }
  return dds::make_topic(entity(), info);
}

Result<void> ControlClient::read_own(dds::TopicReader& answers, dds::Entity topic, const dds::Qos& qos) {
  PLCHOST_TRY_ASSIGN(auto reader, dds::make_reader(own_subscriber_.get(), topic.get(), qos));
  answers = {.topic = std::move(topic), .reader = std::move(reader)};
  return wait_set_.add(answers.reader.get(), DDS_DATA_AVAILABLE_STATUS);
}

Result<RequestCaller*> ControlClient::caller(const std::string& host, bool engineering) {
  const std::pair key(host, engineering);
  if (const auto known = callers_.find(key); known != callers_.end()) return &known->second;
  const dds::Qos qos = dds::answers_qos(dds::kReply, dds::kReply.qos.depth);
  PLCHOST_TRY(open_own_reader<plc_Reply>(replies_, qos));
  dds::Entity& topic = request_topics_.at(engineering ? 1 : 0);
  if (!topic) {
    PLCHOST_TRY_ASSIGN(
        topic, dds::make_topic(entity(), engineering ? dds::kEngineerRequest : dds::kOperatorRequest));
  }
  PLCHOST_TRY_ASSIGN(auto made, RequestCaller::create(entity(), topic.get(), host));
  PLCHOST_TRY(wait_set_.add(made.writer(), DDS_PUBLICATION_MATCHED_STATUS));
  own_answers_.add(made.guid());
  return &callers_.emplace(key, std::move(made)).first->second;
}

const HostClock* ControlClient::clock_of(const std::string& host) const {
  const SeenHost* const seen = seen_.find(host);
  return seen == nullptr || seen->server.value() == 0 ? nullptr : &seen->clock;
}

Result<ApiReply> ControlClient::ask(const ApiRequest& request, TimePoint deadline,
                                    const RequestCaller::Meanwhile& meanwhile) {
  const bool engineering = is_engineering(request.operation);
  PLCHOST_TRY_ASSIGN(const auto asked, caller(request.host, engineering));
  update_hosts();  // the limit is by the newest presence
  const auto clock = [&] { return clock_of(request.host); };
  auto reply = asked->call(request, replies_.reader.get(), wait_set_, deadline, clock, answering_, meanwhile);
  if (!reply) {
    own_answers_.remove(asked->guid());
    callers_.erase({request.host, engineering});
  }
  return reply;
}

Result<ApiReply> ControlClient::call(const ApiRequest& request, TimePoint deadline) {
  PLCHOST_TRY(check_api_request(request, only_));
  const auto look = [&, woken = false](const auto& /*identity*/, TimePoint /*now*/) mutable {
    if (std::exchange(woken, true)) update();
    return RequestCaller::Wait{.deadline = deadline};
  };
  auto reply = ask(request, deadline, look);
  if (reply) await_status(request.host, *reply, deadline);
  return reply;
}

void ControlClient::await_status(const std::string& host, const ApiReply& reply, TimePoint deadline) {
  for (;;) {
    update();
    const auto view = present(host);
    if (!view || view->status.round >= reply.status_round || MonotonicClock::now() >= deadline) return;
    wait_set_.wait(deadline);
  }
}

}  // namespace plchost
