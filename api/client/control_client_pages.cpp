#include <algorithm>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client.hpp"
#include "api/client/control_client_status.hpp"
#include "api/dds/sample_identity.hpp"

namespace plchost {

namespace {

// A page that has not come so long after the answer will not: it is asked for again.
constexpr Duration kPagePatience = std::chrono::milliseconds(500);
constexpr Duration kBusyPause = std::chrono::milliseconds(50);

template <class Page>
std::optional<ListingOf<Page>> take_page(dds_entity_t reader, dds::HostWriters& writers,
                                         std::string_view host, const plc_SampleIdentity& identity) {
  std::optional<ListingOf<Page>> found;
  dds::take_valid_told<Page, dds::kTopicOf<Page>.qos.depth>(
      reader, writers, [&](const Page& page, const auto& /*info*/) {
        // Others answer calls that were given up, or are of a host that was not asked.
        if (same_identity(page.related_identity, identity) && dds::text_of(page.host) == host) {
          found = listing_of(page);
        }
      });
  return found;
}

}  // namespace

template <class Page>
Result<ListingOf<Page>> ControlClient::ask_for_page(const ApiRequest& request, TimePoint deadline) {
  PLCHOST_TRY(check_host_name(request.host, only_));
  const dds::TopicInfo& topic = dds::kTopicOf<Page>;
  dds::TopicReader& pages = std::get<Pages<Page>>(pages_).from;
  const dds::Qos qos = dds::answers_qos(topic, topic.qos.depth);
  PLCHOST_TRY(open_own_reader<Page>(pages, qos));
  for (;;) {
    PLCHOST_TRY_ASSIGN(const auto reply, call(request, deadline));
    if (reply.code != ErrorCode::ok && reply.code != ErrorCode::busy) return failure(reply.code, reply.text);
    const TimePoint patience =
        MonotonicClock::now() + (reply.code == ErrorCode::ok ? kPagePatience : kBusyPause);
    const TimePoint until = std::min(deadline, patience);
    for (;;) {
      if (auto listing = take_page<Page>(pages.reader.get(), answering_, request.host, reply.identity))
        return *std::move(listing);
      if (MonotonicClock::now() >= until) break;
      update();
      wait_set_.wait(until);
    }
    if (MonotonicClock::now() >= deadline) break;
  }
  return failure(ErrorCode::timed_out,
                 fmt::format("the answer of host '{}' has not come ({})", request.host, topic.name));
}

template <class Page>
Result<ListingOf<Page>> ControlClient::list(const std::string& host, std::int32_t operation,
                                            const Result<plc_ListPart>& part, TimePoint deadline) {
  if (!part) return std::unexpected(part.error());
  return ask_for_page<Page>(
      {.host = host, .operation = operation, .instance = "", .argument = "", .part = *part}, deadline);
}

Result<ObjectListing> ControlClient::list_objects(const std::string& host, const ObjectQuery& query,
                                                  TimePoint deadline) {
  return list<plc_ObjectPage>(host, plc_OPERATION_LIST_OBJECTS, part_of(query), deadline);
}

Result<NodesTold> ControlClient::list_nodes(const std::string& host, const NodeQuery& query,
                                            TimePoint deadline) {
  return list<plc_NodePage>(host, plc_OPERATION_LIST_NODES, part_of(query), deadline);
}

Result<NodesTold> ControlClient::list_routes(const std::string& host, const NodeQuery& query,
                                             TimePoint deadline) {
  return list<plc_NodePage>(host, plc_OPERATION_LIST_ROUTES, part_of(query), deadline);
}

Result<LogListing> ControlClient::read_log(const std::string& host, const std::string& instance,
                                           const LogQuery& query, TimePoint deadline) {
  return ask_for_page<plc_LogPage>({.host = host,
                                    .operation = plc_OPERATION_READ_LOG,
                                    .instance = instance,
                                    .argument = "",
                                    .part = part_of(query)},
                                   deadline);
}

}  // namespace plchost
