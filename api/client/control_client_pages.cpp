#include <algorithm>

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

template <class Page, class Listing>
std::optional<Listing> take_page(dds_entity_t reader, dds::HostWriters& writers, std::string_view host,
                                 const plc_SampleIdentity& identity) {
  std::optional<Listing> found;
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

template <class Page, class Listing>
Result<Listing> ControlClient::ask_for_page(dds::TopicReader& pages, const dds::TopicInfo& topic,
                                            const ApiRequest& request, TimePoint deadline) {
  PLCHOST_TRY(check_host_name(request.host, only_));
  const dds::Qos qos = dds::answers_qos(topic, topic.qos.depth);
  if (auto opened = open_own_reader<Page>(pages, qos); !opened) {
    return std::unexpected(opened.error());
  }
  for (;;) {
    const auto reply = call(request, deadline);
    if (!reply) return std::unexpected(reply.error());
    if (reply->code != ErrorCode::ok && reply->code != ErrorCode::busy)
      return failure(reply->code, reply->text);
    const TimePoint patience =
        MonotonicClock::now() + (reply->code == ErrorCode::ok ? kPagePatience : kBusyPause);
    const TimePoint until = std::min(deadline, patience);
    for (;;) {
      if (auto listing =
              take_page<Page, Listing>(pages.reader.get(), answering_, request.host, reply->identity))
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

Result<ObjectListing> ControlClient::list_objects(const std::string& host, const ObjectQuery& query,
                                                  TimePoint deadline) {
  const auto part = part_of(query);
  if (!part) return std::unexpected(part.error());
  return ask_for_page<plc_ObjectPage, ObjectListing>(
      object_pages_, dds::kObjectPage,
      {.host = host, .operation = plc_OPERATION_LIST_OBJECTS, .instance = "", .argument = "", .part = *part},
      deadline);
}

Result<NodesTold> ControlClient::list_nodes(const std::string& host, const NodeQuery& query,
                                            TimePoint deadline) {
  const auto part = part_of(query);
  if (!part) return std::unexpected(part.error());
  return ask_for_page<plc_NodePage, NodesTold>(
      node_pages_, dds::kNodePage,
      {.host = host, .operation = plc_OPERATION_LIST_NODES, .instance = "", .argument = "", .part = *part},
      deadline);
}

Result<NodesTold> ControlClient::list_routes(const std::string& host, const NodeQuery& query,
                                             TimePoint deadline) {
  const auto part = part_of(query);
  if (!part) return std::unexpected(part.error());
  return ask_for_page<plc_NodePage, NodesTold>(
      node_pages_, dds::kNodePage,
      {.host = host, .operation = plc_OPERATION_LIST_ROUTES, .instance = "", .argument = "", .part = *part},
      deadline);
}

Result<LogListing> ControlClient::read_log(const std::string& host, const std::string& instance,
                                           const LogQuery& query, TimePoint deadline) {
  return ask_for_page<plc_LogPage, LogListing>(log_pages_, dds::kLogPage,
                                               {.host = host,
                                                .operation = plc_OPERATION_READ_LOG,
                                                .instance = instance,
                                                .argument = "",
                                                .part = part_of(query)},
                                               deadline);
}

}  // namespace plchost
