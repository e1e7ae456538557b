#include "api/client/request_caller.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "api/client/met_readers.hpp"
#include "api/dds/sample_identity.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

namespace {

std::optional<ApiReply> take_reply(dds_entity_t reader, dds::HostWriters& writers, std::string_view host,
                                   const plc_SampleIdentity& identity) {
  std::optional<ApiReply> found;
  dds::take_valid_told<plc_Reply, 16>(reader, writers, [&](const plc_Reply& reply, const auto& info) {
    // Others are answers to calls that were given up, or of a host that was not asked.
    if (!same_identity(reply.header.related_identity, identity) || dds::text_of(reply.host) != host) return;
    found = ApiReply{static_cast<ErrorCode>(reply.code), std::string(dds::text_of(reply.text)),
                     reply.status_round, identity, info.source_timestamp};
  });
  return found;
}

}  // namespace

Result<RequestCaller> RequestCaller::create(dds_entity_t participant, dds_entity_t topic,
                                            const std::string& host) {
  RequestCaller caller;
  auto way =
      dds::open_writer(participant, dds::host_partition(host), topic, dds::qos_of(dds::kOperatorRequest));
  if (!way) return std::unexpected(std::move(way).error());
  caller.way_ = *std::move(way);
  caller.guid_ = dds::guid_of(caller.way_.writer.get());
  return caller;
}

Result<ApiReply> RequestCaller::call(const ApiRequest& request, dds_entity_t reply_reader,
                                     const WaitSet& wait_set, TimePoint deadline, const ClockOf& clock,
                                     dds::HostWriters& answering, const Meanwhile& meanwhile) {
  plc_Request sample{};
  guid_.copy_to(sample.header.request_identity.writer_guid);
  sample.header.request_identity.sequence_number = ++last_number_;
  dds::copy_text(sample.header.instance_name, request.host);
  sample.operation = request.operation;
  dds::copy_text(sample.instance, request.instance);
  dds::copy_text(sample.argument, request.argument);
  sample.boot = request.boot;
  sample.online = request.online;
  sample.size = request.size;
  dds::copy_text(sample.sha256, request.sha256);
  sample.part = request.part;
  TimePoint next_write{};
  std::int64_t asked_unix_ns = 0;
  bool written = false;
  Wait wait{.deadline = deadline};
  for (TimePoint now = MonotonicClock::now(); now < wait.deadline; now = MonotonicClock::now()) {
    if (auto reply = take_reply(reply_reader, answering, request.host, sample.header.request_identity)) {
      reply->asked_unix_ns = asked_unix_ns;
      reply->heard_unix_ns = unix_time_ns();
      return *reply;
    }
    const HostClock* const host_clock = clock();
    if (now >= next_write && host_clock != nullptr && has_reader(way_.writer.get())) {
      sample.limit = host_clock->limit_at(wait.deadline);
      if (!written) asked_unix_ns = unix_time_ns();
      (void)dds_write(way_.writer.get(), &sample);  // a refusal of DDS is mended by the repetition
      next_write = now + (written ? kRepeat : kFirstRepeat);
      written = true;
    }
    if (meanwhile) wait = meanwhile(sample.header.request_identity, now);
    wait_set.wait(std::min({wait.deadline, wait.next, std::max(next_write, now + kFirstRepeat)}));
  }
  return failure(ErrorCode::timed_out,
                 fmt::format("host '{}' has not answered; if it has not begun the command, it never will",
                             request.host));
}

}  // namespace plchost
