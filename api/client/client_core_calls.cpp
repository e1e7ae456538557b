// Requests and their answers.
#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/client_core.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

ApiRole role_of(std::int32_t operation) {
  const Operation* const known = find_operation(operation);
  return known != nullptr ? known->role : ApiRole::operating;
}

std::unique_ptr<plc_Request> sample_of(const ApiRequest& request) {
  auto made = std::make_unique<plc_Request>();
  plc_Request& sample = *made;
  dds::copy_text(sample.header.instance_name, request.host);
  sample.operation = request.operation;
  dds::copy_text(sample.instance, request.instance);
  dds::copy_text(sample.argument, request.argument);
  sample.boot = request.boot;
  sample.online = request.online;
  sample.size = request.size;
  dds::copy_text(sample.sha256, request.sha256);
  sample.part = request.part;
  return made;
}

}  // namespace

AnswerKey ClientCore::Asking::key() const {
  return {request->header.request_identity, dds::text_of(request->header.instance_name)};
}

void ClientCore::take_replies() {
  dds::take_valid_told<plc_Reply, 16>(
      replies_.reader.get(), answering_, [&](const plc_Reply& reply, const auto& info) {
        replied_.put({reply.header.related_identity, dds::text_of(reply.host)}, [&] {
          return ApiReply{static_cast<ErrorCode>(reply.code), printable_lines(dds::text_of(reply.text)),
                          reply.status_round, reply.header.related_identity, info.source_timestamp};
        });
      });
}

Result<std::shared_ptr<RequestCaller>> ClientCore::caller(const std::string& host, ApiRole role) {
  static constexpr std::array kTopics{dds::kViewerRequest, dds::kOperatorRequest, dds::kEngineerRequest};
  const std::pair key(host, role);
  if (const auto known = callers_.find(key); known != callers_.end()) return known->second;
  const dds::Qos qos = dds::answers_qos(dds::kReply, dds::kReply.qos.depth);
  PLCHOST_TRY(open_own_reader<plc_Reply>(replies_, qos));
  dds::Entity& topic = request_topics_.at(std::to_underlying(role));
  if (!topic) {
    PLCHOST_TRY_ASSIGN(topic, dds::make_topic(entity(), kTopics.at(std::to_underlying(role))));
  }
  PLCHOST_TRY_ASSIGN(auto made, RequestCaller::create(entity(), topic.get(), host));
  PLCHOST_TRY(pump_->set().add(made.writer(), DDS_PUBLICATION_MATCHED_STATUS));
  own_answers_.add(made.guid());
  const auto end = [this](RequestCaller* caller) {
    own_answers_.remove(caller->guid());
    delete caller;
  };
  return callers_[key] = std::shared_ptr<RequestCaller>(new RequestCaller(std::move(made)), end);
}

Result<ClientCore::Asking> ClientCore::begin_asking(const ApiRequest& request) {
  Asking asking{.caller = {}, .request = sample_of(request)};
  PLCHOST_TRY_ASSIGN(asking.caller, caller(request.host, role_of(request.operation)));
  asking.caller->number(*asking.request);
  return asking;
}

// The next request has a new writer; those beside this one keep theirs.
void ClientCore::give_up(const Asking& asking) {
  std::erase_if(callers_, [&](const auto& entry) { return entry.second == asking.caller; });
}

Async<Result<ApiReply>> ClientCore::ask(Asking asking, TimePoint deadline, Meanwhile meanwhile) {
  Inbox<ApiReply>::Expected answer(replied_, asking.key());
  const std::string host(dds::text_of(asking.request->header.instance_name));
  update_hosts();  // the limit is by the newest presence
  pump_->look_again();
  TimePoint next_write{};
  std::int64_t asked_unix_ns = 0;
  bool written = false;
  Wait wait{.next = TimePoint::max(), .deadline = deadline};
  for (bool last_look = false;;) {
    const TimePoint now = MonotonicClock::now();
    if (auto reply = answer.take_first()) {
      reply->asked_unix_ns = asked_unix_ns;
      reply->heard_unix_ns = unix_time_ns();
      co_return *std::move(reply);
    }
    if (now >= wait.deadline) {
      if (std::exchange(last_look, true)) break;
      look();  // another call may have kept the thread for so long
      continue;
    }
    const HostClock* const clock = clock_of(host);
    if (now >= next_write && clock != nullptr && asking.caller->matched()) {
      asking.request->limit = clock->limit_at(wait.deadline);
      if (!written) asked_unix_ns = unix_time_ns();
      asking.caller->write(*asking.request);
      next_write = now + (written ? RequestCaller::kRepeat : RequestCaller::kFirstRepeat);
      written = true;
    }
    if (meanwhile) wait = meanwhile(now);
    const TimePoint repeat = std::max(next_write, now + RequestCaller::kFirstRepeat);
    const TimePoint until = std::min({wait.deadline, wait.next, repeat});
    co_await pump_->change(until);
  }
  give_up(asking);
  co_return failure(
      ErrorCode::timed_out,
      fmt::format("host '{}' has not answered; if it has not begun the command, it never will", host));
}

Async<Result<ApiReply>> ClientCore::call(ApiRequest request, TimePoint deadline) {
  PLCHOST_CO_TRY(check_api_request(request, only_));
  PLCHOST_CO_TRY_ASSIGN(auto asking, begin_asking(request));
  auto reply = co_await ask(std::move(asking), deadline, {});
  if (reply) {
    const std::uint64_t round = reply->status_round;
    co_await await_status(request.host, round, deadline);
  }
  co_return reply;
}

Async<Result<void>> ClientCore::await_status(std::string host, std::uint64_t round, TimePoint deadline) {
  look();
  for (;;) {
    const auto view = present(host);
    if (!view || view->status.round >= round || MonotonicClock::now() >= deadline) co_return Result<void>();
    co_await pump_->change(deadline);
  }
}

}  // namespace plchost
